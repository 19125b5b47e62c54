"""The guardian: how long the lasers stay lit after the workbench ends or hangs, at the simulated chip's pins.

The limits asserted are the safety requirement, not a matter of speed. Each time is from just before the
process is ended to the moment, on the same clock, when the pins of the chip are low.
"""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from shutil import which

import pytest

from tests.conftest import REAL_TIME
from tests.firmware.parts import KINDS, Change, Kind, Running, build, hurried, hurry, is_there
from tests.support.lasers import serial_bank
from workbench.devices.guarded_lasers import GuardedLaserBank
from workbench.devices.guardian import answer, public_name
from workbench.model.errors import (
    LaserOffNotConfirmedError,
    LeaseEndedError,
    RigNotReadyError,
    StoppedError,
)

ROOT = Path(__file__).parents[3]
IDS = ("L1", "L2", "L3", "L4")
LIT = 0b0101
END_MS = 50
HANG_MS = 600
REPEATS = 3
ORDINARY = ("setpriv", "--bounding-set=-sys_nice")
"""Runs a command without the right to real-time priority."""


@pytest.fixture(scope="module", params=KINDS)
def controller(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    kind: Kind = request.param
    folder = tmp_path_factory.mktemp(f"guardian-{kind}")
    build(kind, folder)
    running = Running(kind, folder, folder / "pins.log")
    yield running
    running.stop()


class AtWork:
    """A process that lights two lasers and works on."""

    def __init__(self, controller: Running, work: str = "beats", *, ordinary: bool = False) -> None:
        self._controller = controller
        self.terminal, theirs = os.openpty()
        self.process = subprocess.Popen(
            [
                *(ORDINARY if ordinary else ()),
                sys.executable,
                "-m",
                "tests.support.at_work",
                controller.port,
                work,
            ],
            cwd=ROOT,
            stdin=theirs if work == "terminal" else subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
            text=True,
        )
        if not ordinary:
            hurry(self.process.pid, before=1)  # not before the guardian and the instruments: it computes
        os.close(theirs)
        assert self.process.stdout is not None
        try:
            self.guardian = int(self.process.stdout.readline())
            controller.wait_for(LIT)
        except BaseException:
            self.process.kill()
            self.process.wait(20)
            raise

    def off_after(self, end: Callable[[AtWork], object]) -> float:
        """Milliseconds from `end` to the pins all low."""
        assert self._controller.lines() == LIT
        with hurried():
            began_ns = time.monotonic_ns()
            end(self)
        return (self._controller.wait_for(0).time_ns - began_ns) / 1e6

    def clear(self) -> None:
        self.process.kill()
        with suppress(ProcessLookupError):
            os.kill(self.guardian, signal.SIGCONT)
        self.process.communicate(timeout=20)
        os.close(self.terminal)
        deadline = time.monotonic() + 10
        while is_there(self.guardian) and time.monotonic() < deadline:
            time.sleep(0.01)  # it lets go of the port


def measure(
    controller: Running, name: str, work: str, end: Callable[[AtWork], None], *, ordinary: bool = False
) -> list[float]:
    """End `REPEATS` processes; how long the lasers stayed lit after it, ms, in ascending order."""
    delays = []
    for repeat in range(REPEATS):
        at_work = AtWork(controller, work, ordinary=ordinary)
        try:
            time.sleep(0.03 * repeat)  # at another moment of its work
            delays.append(at_work.off_after(end))
            time.sleep(0.05)
            assert controller.lines() == 0  # and they stay off
        finally:
            at_work.clear()
    print(f"{name}, {work}: off after", ", ".join(f"{d:.1f}" for d in delays), "ms")
    return sorted(delays)


@pytest.mark.parametrize("work", ["beats", "computes"])
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGHUP])
def test_off_when_the_workbench_is_ended(controller: Running, number: signal.Signals, work: str) -> None:
    assert measure(controller, number.name, work, lambda it: it.process.send_signal(number))[-1] <= END_MS


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_off_when_a_suspended_workbench_is_ended(controller: Running, number: signal.Signals) -> None:
    """A suspended process takes no SIGTERM; the guardian sees that it is pending."""

    def end(at_work: AtWork) -> None:
        at_work.process.send_signal(signal.SIGSTOP)
        at_work.process.send_signal(number)

    assert measure(controller, f"SIGSTOP, {number.name}", "beats", end)[-1] <= END_MS


@pytest.mark.skipif(which("setpriv") is None, reason="the privilege is taken away by setpriv (util-linux)")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_off_without_real_time_priority_on_a_busy_computer(
    controller: Running, number: signal.Signals
) -> None:
    """As an ordinary user, with two other programs for each core: the controller's lease is the limit."""
    busy = [
        subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(2 * (os.cpu_count() or 1))
    ]
    try:
        delays = measure(
            controller,
            f"{number.name}, ordinary user, busy",
            "beats",
            lambda it: it.process.send_signal(number),
            ordinary=True,
        )
    finally:
        for process in busy:
            process.kill()
            process.wait()
    assert delays[-1] <= HANG_MS


def test_off_when_a_workbench_with_all_its_libraries_is_killed(controller: Running) -> None:
    """The kernel gives back the memory of what it ends before it closes the pipe: that is not waited for."""
    delays = measure(controller, "SIGKILL", "loaded", lambda it: it.process.send_signal(signal.SIGKILL))
    assert delays[-1] <= END_MS


def test_off_when_its_terminal_closes(controller: Running) -> None:
    def close(at_work: AtWork) -> None:
        os.close(at_work.terminal)
        at_work.terminal = os.open("/dev/null", os.O_RDONLY)

    assert measure(controller, "closed terminal", "terminal", close)[-1] <= END_MS


def test_off_when_it_is_suspended(controller: Running) -> None:
    delays = measure(controller, "SIGSTOP", "beats", lambda it: it.process.send_signal(signal.SIGSTOP))
    assert delays[-1] <= END_MS


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_off_when_the_guardian_itself_is_gone_or_hangs(controller: Running, number: signal.Signals) -> None:
    """No one is left to send anything: the line falls silent, and the controller's own lease ends."""
    assert (
        measure(controller, f"guardian {number.name}", "beats", lambda it: os.kill(it.guardian, number))[-1]
        <= HANG_MS
    )


def test_what_a_terminal_sends_does_not_end_the_guardian(controller: Running) -> None:
    at_work = AtWork(controller)
    try:
        for number in (signal.SIGINT, signal.SIGHUP, signal.SIGTERM, signal.SIGQUIT, signal.SIGTSTP):
            os.kill(at_work.guardian, number)
        time.sleep(0.2)
        assert controller.lines() == LIT
        assert os.getsid(at_work.guardian) == at_work.guardian  # a session of its own
        assert at_work.off_after(lambda it: it.process.kill()) <= END_MS
    finally:
        at_work.clear()


@pytest.fixture
def bank(controller: Running) -> Iterator[GuardedLaserBank]:
    bank = serial_bank(controller.port, IDS)
    with hurried():  # half a second without a turn is a hang, and here it would be no finding
        yield bank
    bank.close()


def test_a_hang_is_told_when_it_is_over(controller: Running, bank: GuardedLaserBank) -> None:
    def hang() -> None:
        controller.wait_for(1)
        controller.wait_for(0)
        bank.beat()
        time.sleep(0.1)
        assert controller.lines() == 0  # a late beat lights nothing

    with (
        pytest.raises(RigNotReadyError, match=r"no sign of life from the workbench for 0.5 s"),
        bank.lit(["L1"], for_s=5.0),
    ):
        hang()
    with bank.lit(["L2"], for_s=5.0):  # and the next capture is as any other
        assert controller.lines() == 2


def test_beats_hold_the_light_to_its_end_and_not_beyond(controller: Running, bank: GuardedLaserBank) -> None:
    """The controller is given short leases; renewing them leaves no gap."""
    already = len(controller.changes())

    def lit_to_the_end() -> Iterator[Change]:
        with bank.lit(["L3"], for_s=1.2):
            yield controller.wait_for(4)
            while controller.lines():
                bank.beat()
                time.sleep(0.01)
            yield controller.wait_for(0)

    lit = lit_to_the_end()
    on, off = next(lit), next(lit)
    with pytest.raises(LeaseEndedError):
        next(lit)
    assert len(controller.changes()) == already + 2
    lit_ms = (off.time_ns - on.time_ns) / 1e6
    print(f"lit for {lit_ms:.1f} of 1200 ms")
    assert 1100 < lit_ms < 1450


def test_beats_without_light_are_nothing(controller: Running, bank: GuardedLaserBank) -> None:
    already = len(controller.changes())
    bank.beat()
    with bank.lit(["L1"], for_s=1.0):
        pass
    bank.beat()
    assert len(controller.changes()) == already + 2


def test_after_a_signal_to_end_nothing_is_lit_any_more(controller: Running, bank: GuardedLaserBank) -> None:
    def be_told() -> None:
        controller.wait_for(1)
        os.kill(os.getpid(), signal.SIGTERM)
        controller.wait_for(0)

    before = signal.signal(signal.SIGTERM, lambda number, frame: None)
    try:
        with pytest.raises(StoppedError, match="stopped by SIGTERM"), bank.lit(["L1"], for_s=5.0):
            be_told()
        with pytest.raises(StoppedError, match="SIGTERM"), bank.lit(["L1"], for_s=5.0):
            pytest.fail("nothing was lit")
    finally:
        signal.signal(signal.SIGTERM, before)
    assert controller.lines() == 0


def test_a_guardian_that_is_gone_confirms_nothing(controller: Running) -> None:
    bank = serial_bank(controller.port, IDS)
    with (
        pytest.raises(LaserOffNotConfirmedError, match=r"guardian .* has ended"),
        bank.lit(["L1"], for_s=5.0),
    ):
        os.kill(bank._guardian._process.pid, signal.SIGKILL)
    with pytest.raises(LaserOffNotConfirmedError):
        bank.close()
    controller.wait_for(0)


def test_the_port_is_the_guardians_alone(controller: Running, bank: GuardedLaserBank) -> None:
    ours = {str(path.resolve()) for path in Path("/proc/self/fd").iterdir()}
    assert controller.port not in ours
    with pytest.raises(RigNotReadyError, match="no other program holds"):
        serial_bank(controller.port, IDS)


def test_files_with_real_time_priority_run_one_after_the_other() -> None:
    users = {
        path.relative_to(ROOT).as_posix()
        for path in ROOT.glob("tests/**/test_*.py")
        if re.search(r"firmware\.parts import .*\b(hurry|hurried|Running)\b", path.read_text())
    }
    assert users == REAL_TIME


def test_the_interlock_is_told(controller: Running, bank: GuardedLaserBank) -> None:
    assert bank.state().interlock_closed
    with bank.lit(["L1", "L4"], for_s=5.0):
        assert bank.state().lit == ("L1", "L4")
    controller.toggle_interlock()
    deadline = time.monotonic() + 5
    while bank.state().interlock_closed:
        assert time.monotonic() < deadline
    controller.toggle_interlock()


@pytest.mark.parametrize("value", [object(), {1}, "\udc80"])
def test_every_answer_is_one_line_of_json(value: object) -> None:
    read, write = os.pipe()
    code = answer(write, 7, lambda: value)
    os.close(write)
    with os.fdopen(read) as answers:
        [line] = answers.read().splitlines()
    said = json.loads(line)
    assert said["to"] == 7
    assert (code, said.get("error")) in {(0, None), (4, "RigNotReadyError")}
    assert ("value" in said) == isinstance(value, str)


def test_an_error_that_a_driver_derived_is_answered_as_its_base() -> None:
    class UnpluggedError(RigNotReadyError):
        pass

    assert public_name(UnpluggedError("gone")) == "RigNotReadyError"
    assert public_name(LaserOffNotConfirmedError("on")) == "LaserOffNotConfirmedError"
