"""The firmware's core against the emulated controller: two independent programs of one protocol."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.firmware.parts import build
from workbench.emulator.controller import IDENTITY, Controller
from workbench.emulator.spec import ControllerSpec

IDS = ("L1", "L2", "L3", "L4")
CORE_IDENTITY = "laser-range-workbench,laser controller,0,1"
BOOT_MS = 2**32 - 1500
"""The clock wraps in the midst of a test."""


class Inputs(ctypes.Structure):
    _fields_ = (
        ("now_ms", ctypes.c_uint32),
        ("interlock_closed", ctypes.c_bool),
        ("lines", ctypes.c_uint8),
    )


class Core:
    """The C code, with a clock and an interlock that the test holds."""

    def __init__(self, library: ctypes.CDLL) -> None:
        self._c = library
        self._struct = ctypes.create_string_buffer(256)
        self.inputs = Inputs(BOOT_MS, True, 0)
        self._c.laser_boot(self._struct)

    def lines(self) -> int:
        self.inputs.lines = self._c.laser_outputs(self._struct, ctypes.byref(self.inputs))
        return int(self.inputs.lines)

    def receive(self, data: bytes) -> bytes:
        answers = b""
        for byte in data:
            reply = ctypes.create_string_buffer(64)
            length = self._c.laser_receive(self._struct, ctypes.byref(self.inputs), byte, reply)
            answers += reply.raw[:length]
            self.lines()
        return answers

    def wait(self, ms: int) -> None:
        self.inputs.now_ms = (self.inputs.now_ms + ms) % 2**32
        self.lines()


@dataclass
class Clock:
    ms: int = 0

    def __call__(self) -> float:
        return self.ms / 1000


@pytest.fixture(scope="session")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    folder: Path = tmp_path_factory.mktemp("core")
    build("core", folder)
    loaded = ctypes.CDLL(str(folder / "laser_controller.so"))
    loaded.laser_outputs.restype = ctypes.c_uint8
    loaded.laser_receive.restype = ctypes.c_size_t
    loaded.laser_receive.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_char, ctypes.c_char_p]
    return loaded


def requests() -> st.SearchStrategy[bytes]:
    """Whole requests with numbers at and around their bounds, torn ones, and bytes that mean nothing."""
    numbers = st.sampled_from(["0", "1", "4", "5", "15", "16", "007", "60000", "60001", "65535", "65536"])
    number = numbers | st.integers(-5, 10**12).map(str) | st.sampled_from(["", "1e3", "+1", "0x1", " 1"])
    verbs = st.sampled_from(["ON", "MASK", "STATE?", "OFF", "*IDN?", "INTERLOCK?", "on", "ONE", ""])
    words = st.tuples(verbs, st.lists(number, max_size=4)).map(lambda v: " ".join([v[0], *v[1]]))
    ends = st.sampled_from(["\n", "\r\n", " \n", "", "!", "x" * 70 + "\n", "\n\n"])
    likely = st.tuples(st.integers(1, 15), st.integers(1, 3000)).map(
        lambda v: f"MASK {v[0]} {v[1]}\n".encode()
    )
    return likely | st.tuples(words, ends).map(lambda v: "".join(v).encode()) | st.binary(max_size=80)


events = st.lists(requests() | st.integers(0, 2000) | st.booleans(), max_size=12)


@settings(max_examples=500)
@given(events)
def test_the_same_bytes_get_the_same_answers_and_light(
    library: ctypes.CDLL, happenings: list[bytes | int | bool]
) -> None:
    """Requests, waits in ms, and the interlock set, in any order."""
    core, clock = Core(library), Clock()
    emulated = Controller(IDS, ControllerSpec(), clock)
    for happening in happenings:
        if isinstance(happening, bool):
            core.inputs.interlock_closed = emulated.interlock_closed = happening
        elif isinstance(happening, int):
            core.wait(happening)
            clock.ms += happening
        else:
            expected = emulated.receive(happening).decode("ascii").replace(IDENTITY, CORE_IDENTITY)
            assert core.receive(happening).decode("ascii") == expected
        assert core.lines() == sum(1 << IDS.index(name) for name in emulated.lit())


def test_the_lease_is_never_longer_than_asked_and_ends_across_the_wrap(library: ctypes.CDLL) -> None:
    core = Core(library)
    core.receive(b"ON 3 2000\n")
    core.wait(1999)  # the clock has wrapped
    assert core.inputs.now_ms < BOOT_MS
    assert core.lines() == 0b0100
    core.wait(1)
    assert core.lines() == 0


def test_state_tells_what_the_pins_do_whatever_was_asked_for(library: ctypes.CDLL) -> None:
    core = Core(library)
    core.inputs.lines = 0b0010  # a pin that is stuck
    reply = ctypes.create_string_buffer(64)
    for byte in b"STATE? 9\n":
        length = library.laser_receive(core._struct, ctypes.byref(core.inputs), byte, reply)
    assert reply.raw[:length] == b"OK STATE 9 2 0\n"
