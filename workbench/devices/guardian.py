"""Guardian: a separate process that holds the lasers' device for the workbench.

Its arguments are the laser driver (`module:name` of a `GuardedLine`) and its settings. It imports only that
driver, the base class of settings, and the errors, so that it starts quickly.

It reads commands from standard input, one per line, and writes answers to standard output, one JSON object
per line with the command's number:

    <n> LIT <mask> <ms>   switch these lasers on, for a lease
    <n> OFF               switch all off and verify; reports failures since LIT
    <n> STATE             lasers that are on, and the interlock
    BEAT                  the workbench is working; no answer

The first answer, number 0 without a command, is the device's identity. A second descriptor receives the
numbers of signals to the workbench, one byte each, written by its C-level signal handler.

While no laser is on, the guardian looks every `WATCH_S` whether another program has switched one on, and
switches it off.

The guardian switches all lasers off when the workbench ends in any way or gets SIGTERM or SIGHUP. It also
does so when no beat has come for `hang_s` while a laser was on. The device's clock enforces the last rule: it
never gets a lease longer than `hang_s`, and each beat renews the lease. For a device without leases, such as
a digital output board, the guardian's clock enforces it.
"""

from __future__ import annotations

import json
import math
import os
import signal
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from workbench.devices.guarded_line import TRY_BOARD_S, CheckedLine, driver_errors, open_line
from workbench.devices.guarded_workbench import Workbench
from workbench.model.errors import LaserOffNotConfirmedError, RigNotReadyError, StoppedError, WorkbenchError

LOOK_S = 0.02
"""Interval of checks that the workbench is alive while a laser is on, s. They detect an end that the pipe
does not show: a child process keeps it open, or the workbench has not been scheduled."""
SWITCHED_OFF, AGAIN = "the lasers were switched off during a capture", "Take this capture again"
WATCH_S = 0.5
"""Interval of looks at the device's state while the workbench has no laser on, s."""
TRY_ALONE_S = 1.0
"""Time for which the guardian tries to switch off after the workbench's end, s: twice the longest lease."""
RENEW = 5
"""A lease is renewed after the fraction 1/RENEW of its duration."""


@dataclass
class Lease:
    """Lasers that are on, and until when. Times are of the monotonic clock, s."""

    mask: int
    ends: float
    """End that the workbench requested."""
    renewed: float = 0.0
    """Time of the last renewal."""
    held_until: float = 0.0
    """End of the device's lease."""


class Guardian:
    """Server of one workbench on one device."""

    def __init__(
        self, workbench: Workbench, line: CheckedLine, answers: int, hang_s: float, *, watches: bool
    ) -> None:
        self._workbench, self._line, self._answers, self._hang_s = workbench, line, answers, hang_s
        self._watches = watches
        """Whether to look for emission that another program has switched on."""
        self._lease: Lease | None = None
        self._failure: WorkbenchError | None = None
        """Cause of an off that the workbench does not know of; reported with the next OFF."""
        self._may_be_on = False
        """Whether an off was not confirmed and no lease of the hardware replaces it; it is tried again."""

    def serve(self) -> int:
        """Serve until the workbench is gone, then switch off; returns the exit code."""
        try:
            self._serve()
        finally:
            code = self.leave()
        return code

    def _serve(self) -> None:
        while not self._workbench.gone:
            command = self._workbench.command(self._wait_s())
            if self._workbench.gone:
                break  # the last command is not executed
            if self._lease is not None and self._workbench.end_signal is not None:
                self._put_off(self._stopped())
            if self._lease is not None and self._workbench.suspended:
                self._put_off(RigNotReadyError(f"{SWITCHED_OFF}: the workbench was suspended. {AGAIN}"))
            if command is not None:
                self._obey(command)
            elif self._lease is not None and time.monotonic() >= self._lease.held_until:
                self._end_of_lease(self._lease)
            elif self._lease is None and self._may_be_on:
                self._put_off(self._failure)
            elif self._lease is None and self._watches:
                self._look_for_strangers()

    def _look_for_strangers(self) -> None:
        """Switch off lasers that another program switched on; the next command reports it."""
        try:
            mask, _ = self._line.state()
        except RigNotReadyError:
            return  # the next command meets the same failure
        if mask:
            self._put_off(
                RigNotReadyError(
                    "another program switched lasers on; the workbench switched them off. End that program."
                    f" {AGAIN}"
                )
            )

    def _wait_s(self) -> float | None:
        """Time until the next check, s; None: none."""
        if self._lease is None:
            return LOOK_S if self._may_be_on else WATCH_S if self._watches else None
        return min(LOOK_S, max(0.0, self._lease.held_until - time.monotonic()))

    def _obey(self, command: str) -> None:
        match command.split(" "):
            case ["BEAT"]:
                self._beat()
            case [number, "LIT", mask, lease_ms]:
                answer(self._answers, int(number), lambda: self._light(int(mask), int(lease_ms)))
            case [number, "OFF"]:
                answer(self._answers, int(number), self._off)
            case [number, "STATE"]:
                answer(self._answers, int(number), self._line.state)
            case _:
                raise ValueError(f"no such command: {command}")

    def _light(self, mask: int, lease_ms: int) -> None:
        if self._workbench.end_signal is not None:
            raise self._stopped()
        if self._workbench.suspended:
            raise RigNotReadyError(f"{SWITCHED_OFF}: the workbench was suspended. {AGAIN}")
        if self._failure is not None:
            self._off()
        self._lease = Lease(mask, time.monotonic() + lease_ms / 1000)
        try:
            self._renew(self._lease)
        except RigNotReadyError:
            if self._workbench.end_signal is not None:
                raise self._stopped() from None
            raise

    def _beat(self) -> None:
        lease, now = self._lease, time.monotonic()
        if lease is None or lease.held_until >= lease.ends:
            return
        if now >= lease.held_until:
            self._end_of_lease(lease)  # an expired lease is not renewed
        elif now >= lease.renewed + self._hang_s / RENEW:
            try:
                self._renew(lease)
            except RigNotReadyError as error:
                self._put_off(error if self._workbench.end_signal is None else self._stopped())

    def _renew(self, lease: Lease) -> None:
        lease.renewed = time.monotonic()
        hold_s = min(self._hang_s, lease.ends - lease.renewed)
        lease.held_until = lease.renewed + hold_s
        # The tolerance keeps rounding errors from adding a millisecond.
        self._line.light(lease.mask, max(1, math.ceil(hold_s * 1000 - 1e-3)))

    def _end_of_lease(self, lease: Lease) -> None:
        hung = lease.held_until < lease.ends
        self._put_off(
            RigNotReadyError(
                f"{SWITCHED_OFF}: no sign of life from the workbench for {self._hang_s:g} s; the computer was"
                f" too busy. {AGAIN}"
            )
            if hung
            else None
        )

    def _put_off(self, why: WorkbenchError | None) -> None:
        self._failure = why
        try:
            self._all_off()
        except LaserOffNotConfirmedError as error:
            self._failure = error

    def _off(self) -> None:
        failure, self._failure = self._failure, None
        self._all_off()
        if failure is not None:
            raise failure

    def _all_off(self) -> None:
        self._lease = None
        self._may_be_on = not self._line.has_leases
        self._line.all_off()
        self._may_be_on = False

    def _stopped(self) -> StoppedError:
        return StoppedError(f"stopped by {self._workbench.end_signal}; the lasers were switched off at once")

    def leave(self) -> int:
        """Switch off after the workbench's end, repeatedly if necessary. Returns the exit code."""
        try:
            keep_trying_off(self._line, TRY_ALONE_S if self._line.has_leases else TRY_BOARD_S)
        except LaserOffNotConfirmedError as error:
            with suppress(OSError):
                os.write(sys.stderr.fileno(), f"error: {error}\n".encode(errors="backslashreplace"))
            return error.exit_code
        return 0


def keep_trying_off(line: CheckedLine, for_s: float) -> None:
    """Switch every laser off; an unconfirmed off is tried again for `for_s` seconds.

    Raises:
        LaserOffNotConfirmedError: the last attempt failed.
    """
    deadline = time.monotonic() + for_s
    while True:
        try:
            line.all_off()
        except LaserOffNotConfirmedError:
            if time.monotonic() >= deadline:
                raise
            time.sleep(LOOK_S)
        else:
            return


def identify_dark(line: CheckedLine, boot_s: float) -> str:
    """Identity of a newly opened device; every laser is off afterwards, even if `identify` fails.

    Raises:
        LaserOffNotConfirmedError: the off is not confirmed, and no lease of the hardware ends an emission.
        WorkbenchError: `identify` failed.
    """
    try:
        identity = line.identify(boot_s)
    except WorkbenchError as error:
        try:
            keep_trying_off(line, TRY_ALONE_S)
        except LaserOffNotConfirmedError as unconfirmed:
            if line.has_leases:  # the hardware ends an emission by itself
                raise error from None
            raise LaserOffNotConfirmedError(
                f"{unconfirmed}. The device was not identified: {error}"
            ) from None
        raise
    line.all_off()
    return identity


def answer(answers: int, number: int, act: Callable[[], object]) -> int:
    """Call a function and write its result to the workbench, which may have ended; returns an exit code.

    A result that JSON cannot represent is a defect of the driver and is answered as an error.
    """
    code = 0
    try:
        value = act()
        with driver_errors():
            line = json.dumps({"to": number, "value": value})
    except WorkbenchError as error:
        line = json.dumps({"to": number, "error": public_name(error), "text": str(error)})
        code = error.exit_code
    with suppress(OSError):
        os.write(answers, line.encode() + b"\n")
    return code


def public_name(error: WorkbenchError) -> str:
    """Name in `workbench.model.errors` of an error's class, or of its base class if a driver derived one."""
    return next(kind.__name__ for kind in type(error).__mro__ if kind.__module__ == WorkbenchError.__module__)


def main(
    line: str, settings: str, lasers: int, boot_s: float, hang_s: float, signals: int, watches: bool
) -> int:
    """Hold the device until the workbench ends; returns the exit code."""
    # Signals that a terminal or a system shutdown sends to all processes: only the workbench's end counts.
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP):
        signal.signal(number, signal.SIG_IGN)
    answers = _keep_answers()
    workbench = Workbench(sys.stdin.fileno(), signals)
    opened: list[CheckedLine] = []

    def connect() -> str:
        opened.append(open_line(line, settings, lasers, workbench.alarm, _hurry))
        return identify_dark(opened[0], boot_s)

    code = answer(answers, 0, connect)
    if code not in {0, LaserOffNotConfirmedError.exit_code} or not opened:
        return code
    guardian = Guardian(workbench, opened[0], answers, hang_s, watches=watches)
    return guardian.leave() if code else guardian.serve()


def _hurry() -> None:
    """Set real-time priority if permitted; the guardian sleeps almost always."""
    with suppress(AttributeError, OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(10))


def _keep_answers() -> int:
    """Descriptor for answers; standard output is redirected, so that a driver's output is no answer."""
    answers = os.dup(sys.stdout.fileno())
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, sys.stdout.fileno())
    os.close(null)
    return answers


if __name__ == "__main__":
    _, line, settings, lasers, boot_s, hang_s, signals, watches = sys.argv
    sys.exit(main(line, settings, int(lasers), float(boot_s), float(hang_s), int(signals), watches == "1"))
