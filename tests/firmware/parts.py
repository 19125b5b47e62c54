"""The laser controller's firmware, run: in a simulated ATmega328P, and as a program of this computer."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import pytest

FIRMWARE = Path(__file__).parents[2] / "rigs" / "firmware"
Kind = Literal["chip", "host"]
KINDS: tuple[Kind, ...] = ("chip", "host")
REQUIRED = "WORKBENCH_REQUIRE_SIMAVR"
"""Set to 1, a missing simulator is a failure; otherwise the tests on the chip are skipped."""


def build(kind: Kind | Literal["core", "hanging"], folder: Path) -> None:
    """Build into `folder` what `kind` needs, or skip the test where that cannot be done here."""
    targets = {"chip": ["avr", "sim"], "host": ["host"], "core": ["core"], "hanging": ["hanging", "sim"]}[
        kind
    ]
    tools = ["make", "cc", *(["avr-gcc"] if kind in {"chip", "hanging"} else [])]
    missing = [tool for tool in tools if shutil.which(tool) is None]
    if "sim" in targets and not Path("/usr/include/simavr/sim_avr.h").exists():
        missing.append("libsimavr-dev")
    if missing:
        message = f"the firmware's {kind} build needs {', '.join(missing)} (Debian: see .ci/run)"
        if os.environ.get(REQUIRED) == "1":
            pytest.fail(message)
        pytest.skip(message)
    subprocess.run(["make", "-s", "-C", FIRMWARE, f"BUILD={folder}", *targets], check=True)


@dataclass(frozen=True)
class Change:
    """The pins from a moment on: bit 0 is line 1; time of CLOCK_MONOTONIC, as `time.monotonic_ns`."""

    time_ns: int
    lines: int


def can_hurry() -> bool:
    """Whether real-time priority is allowed here."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    except (AttributeError, OSError):
        return False
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    return True


def is_there(pid: int) -> bool:
    """Whether a process has not ended, be it that nobody has asked yet how it did."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state not in "ZX"


def hurry(pid: int, before: int = 20) -> None:
    """Let a process (0: this one) run before others, where that is allowed; before those of a lower number.

    What is measured at the pins is how the parts work together, not for how long an overloaded computer keeps
    the instruments, or a process that was told to end, from running at all.
    """
    with contextlib.suppress(AttributeError, OSError):
        os.sched_setscheduler(pid, os.SCHED_FIFO, os.sched_param(before))


@contextlib.contextmanager
def hurried() -> Iterator[None]:
    """As `hurry` for this process, for a while: nobody else gets a turn between time and deed."""
    hurry(0, before=30)
    try:
        yield
    finally:
        with contextlib.suppress(AttributeError, OSError):
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


class Running:
    """A controller that runs in a process of its own."""

    def __init__(self, kind: Kind, folder: Path, log: Path, elf: str = "laser_controller.elf") -> None:
        self._log = log
        program = (
            [folder / "sim_controller", folder / elf] if kind == "chip" else [folder / "host_controller"]
        )
        self._process = subprocess.Popen([*program, log], stdout=subprocess.PIPE, text=True)
        hurry(self._process.pid)
        assert self._process.stdout is not None
        self.port = next(line[5:].strip() for line in self._process.stdout if line.startswith("port "))

    def toggle_interlock(self) -> None:
        self._process.send_signal(signal.SIGUSR1)

    def changes(self) -> list[Change]:
        """All changes so far, the state at boot first; a line that is being written is left out."""
        whole = self._log.read_text().rpartition("\n")[0].split("\n")
        return [Change(int(time_ns), int(lines)) for time_ns, lines in (line.split() for line in whole)]

    def lines(self) -> int:
        """What the pins do now."""
        return self.changes()[-1].lines

    def wait_for(self, lines: int, within_s: float = 10.0) -> Change:
        """The change that brought the pins to `lines`, once they are there."""
        deadline = time.monotonic() + within_s
        while (last := self.changes()[-1]).lines != lines:
            assert time.monotonic() < deadline, f"lines {lines} did not come, but {self.changes()}"
            time.sleep(0.001)
        return last

    def stop(self) -> None:
        """End it; a second call has no effect."""
        self._process.kill()
        self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()


Start = Callable[[], Running]
