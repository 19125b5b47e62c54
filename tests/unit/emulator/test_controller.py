"""The emulated controller keeps docs/laser-controller.md, byte by byte."""

from __future__ import annotations

from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench.emulator.controller import IDENTITY, LONGEST_LEASE_MS, Controller
from workbench.emulator.spec import ControllerSpec

IDS = ("L1", "L2", "L3", "L4")


@dataclass
class Clock:
    now: float = 100.0

    def __call__(self) -> float:
        return self.now


def controller(clock: Clock | None = None) -> Controller:
    return Controller(IDS, ControllerSpec(), clock or Clock())


@pytest.mark.parametrize(
    ("request_", "reply"),
    [
        ("*IDN?", f"OK *IDN {IDENTITY}"),
        ("OFF", "OK OFF"),
        ("ON 2 500", "OK ON 2 500"),
        ("ON 4 500", "OK ON 8 500"),
        ("MASK 5 60000", "OK ON 5 60000"),
        ("MASK 0 1", "OK ON 0 1"),
        ("STATE? 7", "OK STATE 7 0 0"),
        ("INTERLOCK?", "OK INTERLOCK CLOSED"),
        ("ON 0 500", "ERR 2 "),
        ("ON 5 500", "ERR 2 "),
        ("ON 1 0", "ERR 2 "),
        ("ON 1 60001", "ERR 2 "),
        ("ON 1 -5", "ERR 2 "),
        ("ON 1 1e3", "ERR 2 "),
        ("ON ² 5", "ERR 2 "),
        ("MASK 16 500", "ERR 2 "),
        ("STATE? 65536", "ERR 2 "),
        ("ON 1", "ERR 1 "),
        ("on 1 500", "ERR 1 "),
        ("STATE?", "ERR 1 "),
        ("  OFF", "OK OFF"),
        ("hello", "ERR 1 "),
        ("x" * 100, "ERR 4 "),
    ],
)
def test_requests_and_replies(request_: str, reply: str) -> None:
    came = controller().receive(request_.encode() + b"\r\n").decode()
    assert came.startswith(reply)
    assert came.endswith("\n")
    assert came.count("\n") == 1


def test_boots_off() -> None:
    assert controller().lit() == ()


def test_a_lease_lights_and_ends_by_itself() -> None:
    clock = Clock()
    c = controller(clock)
    c.receive(b"MASK 5 200\n")
    assert c.lit() == ("L1", "L3")
    clock.now += 0.15
    assert c.receive(b"STATE? 1\n") == b"OK STATE 1 5 50\n"
    clock.now += 0.06
    assert c.lit() == ()
    assert c.receive(b"STATE? 2\n") == b"OK STATE 2 0 0\n"
    clock.now -= 0.2  # an ended lease does not come back
    assert c.lit() == ()


def test_a_new_lease_takes_the_place_of_the_old_one() -> None:
    clock = Clock()
    c = controller(clock)
    c.receive(b"MASK 15 1000\nON 2 100\n")
    assert c.lit() == ("L2",)
    clock.now += 0.2
    assert c.lit() == ()


def test_a_refused_request_leaves_the_lease_alone() -> None:
    c = controller()
    c.receive(b"ON 1 1000\nON 9 1000\nMASK 99 5\n")
    assert c.lit() == ("L1",)


def test_bang_is_off_at_once_amid_a_line() -> None:
    c = controller()
    c.receive(b"ON 1 1000\n")
    assert c.receive(b"MASK 15 10") == b""
    assert c.receive(b"!") == b"OK OFF\n"
    assert c.lit() == ()
    assert c.receive(b"00\n").startswith(b"ERR 1")  # what is left of the torn line lights nothing
    assert c.lit() == ()


def test_open_interlock_puts_off_and_refuses() -> None:
    c = controller()
    c.receive(b"ON 1 1000\n")
    c.interlock_closed = False
    assert c.lit() == ()
    assert c.receive(b"INTERLOCK?\n") == b"OK INTERLOCK OPEN\n"
    assert c.receive(b"ON 1 1000\n") == b"ERR 3 interlock open\n"
    c.interlock_closed = True
    assert c.lit() == ()


def test_bytes_may_arrive_one_by_one() -> None:
    c = controller()
    replies = [c.receive(bytes([byte])) for byte in b"ON 3 50\r\n"]
    assert b"".join(replies) == b"OK ON 4 50\n"
    assert c.lit() == ("L3",)


@given(st.binary(max_size=300))
def test_no_bytes_upset_it(noise: bytes) -> None:
    c = controller()
    for line in c.receive(noise).split(b"\n")[:-1]:
        assert line.startswith((b"OK ", b"ERR "))
    c.receive(b"!")
    assert c.lit() == ()
    assert c.receive(f"ON 1 {LONGEST_LEASE_MS}\n".encode()) == b"OK ON 1 60000\n"
