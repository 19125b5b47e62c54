"""The driver over a real serial line (a pseudo-terminal) to the emulated controller, well and broken."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import pytest

from tests.support.lasers import serial_bank
from workbench.devices.controller_line import ControllerLine, SerialBlock
from workbench.devices.guarded_lasers import GuardedLaserBank
from workbench.devices.guardian import WATCH_S
from workbench.devices.protocols import LaserBank
from workbench.emulator.controller import IDENTITY, Controller
from workbench.emulator.pty import PtyServer
from workbench.emulator.spec import ControllerSpec, Fault
from workbench.model.errors import (
    BadInputError,
    LaserOffNotConfirmedError,
    LeaseEndedError,
    RigNotReadyError,
    StoppedError,
)

IDS = ("L1", "L2", "L3", "L4")


@dataclass
class Wired:
    """A controller, its line, and every byte that went to it."""

    controller: Controller
    server: PtyServer = field(init=False)
    heard: bytearray = field(default_factory=bytearray)
    recoveries: int = 0
    """After how many requests from here the controller is well again; 0: never."""

    def receive(self, data: bytes) -> bytes:
        self.heard.extend(data)
        reply = self.controller.receive(data)
        if self.recoveries:
            self.recoveries -= 1
            if not self.recoveries:
                self.controller.fault = "none"
        return reply


@pytest.fixture
def wired() -> Iterator[Wired]:
    wired = Wired(Controller(IDS, ControllerSpec()))
    wired.server = PtyServer(wired.receive)
    yield wired
    wired.server.close()


@pytest.fixture
def bank(wired: Wired) -> Iterator[GuardedLaserBank]:
    bank = serial_bank(wired.server.port, IDS)
    yield bank
    wired.controller.fault = "none"
    bank.close()


@pytest.fixture
def answering() -> Iterator[Callable[[Callable[[bytes], bytes]], str]]:
    """A port where anything at all answers."""
    servers = []

    def serve(receive: Callable[[bytes], bytes]) -> str:
        servers.append(PtyServer(receive))
        return servers[-1].port

    yield serve
    for server in servers:
        server.close()


def test_off_at_connect(wired: Wired) -> None:
    wired.controller.receive(b"MASK 15 60000\n")
    with_lasers: LaserBank = serial_bank(wired.server.port, IDS)
    assert wired.controller.lit() == ()
    with_lasers.close()


def test_it_knows_whom_it_talks_to(bank: GuardedLaserBank) -> None:
    assert bank.identity == IDENTITY


@pytest.mark.parametrize("ids", [["L1"], ["L4", "L2"], list(IDS), ["L3", "L3"]])
def test_lit_inside_the_block_and_off_after(wired: Wired, bank: GuardedLaserBank, ids: list[str]) -> None:
    with bank.lit(ids, for_s=5.0):
        assert set(wired.controller.lit()) == set(ids)
    assert wired.controller.lit() == ()


def test_lasers_of_one_line_are_on_together(wired: Wired) -> None:
    """Two beams behind a grating on line 1, a laser of its own on line 2."""
    settings = SerialBlock(port=wired.server.port)
    bank = GuardedLaserBank(ControllerLine, settings, ("G1", "G2", "L"), lines=(0, 0, 1))
    for ids, outputs, lit in (
        (["G2"], ("L1",), ("G1", "G2")),
        (["L"], ("L2",), ("L",)),
        (["G1", "G2", "L"], ("L1", "L2"), ("G1", "G2", "L")),
    ):
        with bank.lit(ids, for_s=5.0):
            assert wired.controller.lit() == outputs
            assert bank.state().lit == lit
    bank.close()


def test_off_is_asked_for_and_asked_about(wired: Wired, bank: GuardedLaserBank) -> None:
    wired.heard.clear()
    with bank.lit(["L2"], for_s=0.1234):
        pass
    assert bytes(wired.heard) == b"MASK 2 124\n!STATE? 2\n"


def test_off_after_an_error_in_the_block(wired: Wired, bank: GuardedLaserBank) -> None:
    with pytest.raises(ZeroDivisionError), bank.lit(["L1"], for_s=5.0):
        raise ZeroDivisionError
    assert wired.controller.lit() == ()


def test_a_block_that_outlasts_its_lease_ends_with_an_error(wired: Wired, bank: GuardedLaserBank) -> None:
    """Frames at its end were taken with the lasers off, as if no spot were there."""

    def linger() -> None:
        with bank.lit(["L1"], for_s=0.001):
            deadline = time.monotonic() + 5
            while wired.controller.lit() and time.monotonic() < deadline:
                time.sleep(0.001)
            assert wired.controller.lit() == ()

    with pytest.raises(LeaseEndedError):
        linger()


@pytest.mark.parametrize("ids", [[], ["L9"], ["L1", "all"]])
def test_lasers_that_are_not_there(wired: Wired, bank: GuardedLaserBank, ids: list[str]) -> None:
    with pytest.raises(BadInputError, match="expected some of L1, L2, L3, L4"), bank.lit(ids, for_s=1.0):
        pytest.fail("nothing was lit")


@pytest.mark.parametrize("for_s", [0.0, -1.0, 61.0])
def test_a_lease_that_no_controller_grants(wired: Wired, bank: GuardedLaserBank, for_s: float) -> None:
    wired.heard.clear()
    with pytest.raises(BadInputError, match="at most 60 s, got"), bank.lit(["L1"], for_s=for_s):
        pytest.fail("nothing was lit")
    assert not wired.heard


def test_open_interlock(wired: Wired, bank: GuardedLaserBank) -> None:
    wired.controller.interlock_closed = False
    with pytest.raises(RigNotReadyError, match="interlock open"), bank.lit(["L1"], for_s=1.0):
        pytest.fail("nothing was lit")


def test_a_controller_that_says_ok_but_stays_on(wired: Wired, bank: GuardedLaserBank) -> None:
    with pytest.raises(LaserOffNotConfirmedError, match="may be on"), bank.lit(["L1"], for_s=5.0):
        wired.controller.fault = "ignores_off"
    assert wired.heard.count(b"!") == 4  # connect and its verification, exit, and once more


def test_a_stuck_controller_is_not_connected_to(wired: Wired) -> None:
    wired.controller.receive(b"ON 1 60000\n")
    wired.controller.fault = "ignores_off"
    with pytest.raises(LaserOffNotConfirmedError):
        serial_bank(wired.server.port, IDS)
    wired.controller.fault = "none"
    serial_bank(wired.server.port, IDS).close()  # the port was released


@pytest.mark.parametrize("fault", ["garbles", "silent", "stutters"])
def test_a_controller_that_falls_ill_while_lit(wired: Wired, fault: Fault) -> None:
    bank = serial_bank(wired.server.port, IDS)
    with pytest.raises(LaserOffNotConfirmedError, match="expected 'OK OFF'"), bank.lit(["L1"], for_s=5.0):
        wired.controller.fault = fault
    assert wired.controller.lit() == ()  # it did hear
    wired.controller.fault = "none"
    bank.close()


def test_one_lost_reply_is_forgiven_when_off_is_confirmed(wired: Wired, bank: GuardedLaserBank) -> None:
    with bank.lit(["L1"], for_s=5.0):
        wired.recoveries = 1
        wired.controller.fault = "garbles"
    assert wired.recoveries == 0
    assert wired.controller.lit() == ()


@pytest.mark.parametrize("reply", [b"", b"OK\n", b"\xff\xfe\x00\n", b"OK OF", b"OK OFFER\n", b"x" * 500])
def test_somebody_else_answers(answering: Callable[[Callable[[bytes], bytes]], str], reply: bytes) -> None:
    port = answering(lambda data: reply)
    with pytest.raises(RigNotReadyError, match="'!': expected 'OK OFF', got"):
        serial_bank(port, IDS, boot_s=0.0)


def test_somebody_who_says_ok_to_anything(answering: Callable[[Callable[[bytes], bytes]], str]) -> None:
    with pytest.raises(RigNotReadyError, match=r"'\*IDN\?': expected 'OK \*IDN', got 'OK OFF"):
        serial_bank(answering(lambda data: b"OK OFF\n"), IDS, boot_s=0.0)


def test_a_controller_still_booting_is_waited_for(
    answering: Callable[[Callable[[bytes], bytes]], str],
) -> None:
    controller = Controller(IDS, ControllerSpec())
    requests = []

    def boot(data: bytes) -> bytes:
        requests.append(data)
        return controller.receive(data) if len(requests) > 3 else b"\x00boot\n"

    serial_bank(answering(boot), IDS, boot_s=5.0).close()
    assert len(requests) > 4


def test_the_answer_to_an_earlier_question_confirms_nothing(
    answering: Callable[[Callable[[bytes], bytes]], str],
) -> None:
    """From some moment on every STATE? is answered with what was true before."""
    controller = Controller(IDS, ControllerSpec())
    old = b"OK STATE 1 0 0\n"

    def stale(data: bytes) -> bytes:
        reply = controller.receive(data)
        return old if data.startswith(b"STATE?") else reply

    bank = serial_bank(answering(stale), IDS)  # its first question is number 1
    with pytest.raises(LaserOffNotConfirmedError, match="expected 'OK STATE 3'"), bank.lit(["L1"], for_s=1.0):
        pass
    with pytest.raises(LaserOffNotConfirmedError):
        bank.close()


def test_an_answer_that_was_not_waited_for_confirms_nothing(
    wired: Wired, bank: GuardedLaserBank, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A signal raises while the answer to lighting is waited for; it comes when off is asked for."""
    answer = bank._guardian._answer

    def interrupted(number: int, wait_s: float) -> object:
        monkeypatch.setattr(bank._guardian, "_answer", answer)
        raise StoppedError("stopped by SIGINT")

    monkeypatch.setattr(bank._guardian, "_answer", interrupted)
    wired.controller.fault = "ignores_off"
    with pytest.raises(LaserOffNotConfirmedError), bank.lit(["L1"], for_s=5.0):
        pytest.fail("the block is not entered")


def test_disconnect_in_mid_lease(wired: Wired) -> None:
    bank = serial_bank(wired.server.port, IDS)
    with pytest.raises(LaserOffNotConfirmedError, match="may be on"), bank.lit(["L1"], for_s=5.0):
        wired.server.close()
    with pytest.raises(LaserOffNotConfirmedError):
        bank.close()
    bank.close()  # the second time there is nothing left to close


def test_disconnect_before_lighting(wired: Wired) -> None:
    bank = serial_bank(wired.server.port, IDS)
    wired.server.close()
    with pytest.raises(LaserOffNotConfirmedError) as caught, bank.lit(["L1"], for_s=5.0):
        pytest.fail("nothing was lit")
    assert isinstance(caught.value.__context__, RigNotReadyError)
    with pytest.raises(LaserOffNotConfirmedError):
        bank.close()


def test_no_such_port() -> None:
    with pytest.raises(RigNotReadyError, match="expected a serial port at /dev/not-there"):
        serial_bank("/dev/not-there", IDS)


def test_a_port_has_one_holder(wired: Wired, bank: GuardedLaserBank) -> None:
    with pytest.raises(RigNotReadyError, match="no other program holds"):
        serial_bank(wired.server.port, IDS)


def test_close_puts_off(wired: Wired) -> None:
    bank = serial_bank(wired.server.port, IDS)
    wired.controller.receive(b"ON 1 60000\n")
    bank.close()
    assert wired.controller.lit() == ()


def test_lasers_that_a_stranger_lights_are_put_off_and_reported(wired: Wired, bank: GuardedLaserBank) -> None:
    wired.controller.receive(b"MASK 3 60000\n")
    deadline = time.monotonic() + 10 * WATCH_S
    while wired.controller.lit():
        assert time.monotonic() < deadline
        time.sleep(WATCH_S / 10)
    with pytest.raises(RigNotReadyError, match="another program"), bank.lit(["L1"], for_s=1.0):
        raise AssertionError("lit before it was reported")
    with bank.lit(["L1"], for_s=1.0):
        assert wired.controller.lit() == ("L1",)
