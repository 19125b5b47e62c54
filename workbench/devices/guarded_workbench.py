"""Process that started the guardian, as the kernel sees it. It imports little: the guardian needs it."""

from __future__ import annotations

import os
import select
import signal
from dataclasses import dataclass
from pathlib import Path

AT_ONCE = {int(signal.SIGTERM), int(signal.SIGHUP)}
"""Signals to the workbench on which the lasers are switched off at once."""
SUSPENDED = {b"T", b"t"}
"""States in /proc/PID/stat of a process that a signal or a debugger has stopped."""
STAT_FLAGS = 6
"""Index of the flags in /proc/PID/stat, counted after the process's name."""
ENDING = 0x4 | 0x200 | 0x400
"""PF_EXITING, PF_DUMPCORE, PF_SIGNALED of the kernel's include/linux/sched.h."""


class Workbench:
    """Process that started the guardian, observed by the guardian."""

    def __init__(self, commands: int, signals: int) -> None:
        self._commands, self._signals = commands, signals
        self._pid = os.getppid()
        self._heard = b""
        self.gone = False
        self.end_signal: str | None = None
        """Name of the signal that ends the workbench; None without one."""
        self.suspended = False

    def alarm(self) -> bool:
        """Whether the lasers must be switched off at once."""
        self._look(0.0)
        return self.gone or self.suspended or self.end_signal is not None

    def command(self, wait_s: float | None) -> str | None:
        """Next command; None after another event or without one in `wait_s` (None: no limit)."""
        if b"\n" not in self._heard:
            self._look(wait_s)
        line, found, rest = self._heard.partition(b"\n")
        if not found:
            return None
        self._heard = rest
        return line.decode()

    def _look(self, wait_s: float | None) -> None:
        ready, _, _ = select.select([self._commands, self._signals], [], [], wait_s)
        if self._signals in ready:
            for number in AT_ONCE & set(os.read(self._signals, 64)):
                self.end_signal = signal.Signals(number).name
        if self._commands in ready:
            received = os.read(self._commands, 4096)
            self._heard += received
            self.gone = self.gone or not received
        seen = _as_the_kernel_sees(self._pid)
        self.suspended = seen.suspended
        self.end_signal = self.end_signal or seen.end_signal
        self.gone = self.gone or seen.gone or os.getppid() != self._pid


@dataclass(frozen=True)
class Seen:
    """A process in /proc (proc(5))."""

    gone: bool = False
    """Whether it is about to end."""
    suspended: bool = False
    end_signal: str | None = None
    """Name of a pending signal that ends it."""


def _as_the_kernel_sees(pid: int) -> Seen:
    """State of a process, before its own actions show it.

    A process handles signals and ends only when it is scheduled, and its pipes close only after its core is
    dumped and its memory released. One that is suspended may have a signal in hand that is no longer pending.
    """
    try:
        if Path("/proc/self").readlink() != Path(str(os.getpid())):
            return Seen()  # /proc of another namespace, where the number is another process
        status = Path(f"/proc/{pid}/status").read_bytes()
        stat = Path(f"/proc/{pid}/stat").read_bytes()
    except OSError:
        return Seen()
    waiting = 0
    for line in status.splitlines():
        name, _, mask = line.partition(b":")
        if name in {b"SigPnd", b"ShdPnd"}:
            waiting |= int(mask, 16)
    pending = {number for number in (*AT_ONCE, signal.SIGKILL) if waiting >> (number - 1) & 1}
    fields = stat.rpartition(b")")[2].split()
    names = [signal.Signals(number).name for number in sorted(AT_ONCE & pending)]
    return Seen(
        gone=signal.SIGKILL in pending or bool(int(fields[STAT_FLAGS]) & ENDING),
        suspended=fields[0] in SUSPENDED,
        end_signal=names[0] if names else None,
    )
