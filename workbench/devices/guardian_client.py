"""Client of the guardian in the workbench: starts it, exchanges commands and answers, passes signals on."""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
import subprocess
import sys
import threading
import time

from workbench.devices.guarded_line import TRY_BOARD_S, GuardedLine, line_reference
from workbench.model import errors
from workbench.model.device_block import DeviceBlock
from workbench.model.errors import (
    BadInputError,
    LaserOffNotConfirmedError,
    RigNotReadyError,
    WorkbenchError,
)

ANSWER_S = 15.0
"""Longest wait for an answer, s: a request and two attempts of two requests, of 2.5 s each, and some more."""
LET_GO_S = 3.0
"""Time for a guardian to end if the hardware has no leases and the off is not confirmed, s."""
SAFE_CODES = {0, BadInputError.exit_code, RigNotReadyError.exit_code}
"""Exit codes of a guardian that need no warning: the off was confirmed, or the device was not opened."""


class GuardianClient:
    """Guardian process, see `guardian.py`, which holds the device until this client is closed or ends."""

    def __init__(
        self,
        line_type: type[GuardedLine],
        settings: DeviceBlock,
        lasers: int,
        boot_s: float,
        hang_s: float,
        virtual: bool = False,
    ) -> None:
        """Start the guardian and wait until every laser is off.

        Args:
            line_type: class of the laser driver.
            settings: block of the rig file.
            lasers: number of lasers.
            boot_s: time in which the device must answer, s.
            hang_s: time without a beat after which lasers are switched off, s.
            virtual: whether the beams are simulated. The guardian then writes nothing to the terminal, and
                does not look for other programs' emission: the session itself answers, and may be computing.

        Raises:
            BadInputError: the device has fewer outputs than there are `lasers`.
            RigNotReadyError: the device is missing or held by another program; or it was not identified, but
                confirmed that all lasers are off.
            LaserOffNotConfirmedError: the opened device does not confirm that all lasers are off.
        """
        commands, self._commands = os.pipe()
        self._answers, answers = os.pipe()
        signals, self._signals = os.pipe()
        os.set_blocking(self._signals, False)
        line = [line_reference(line_type), settings.model_dump_json(by_alias=True, exclude_unset=True)]
        call = [*line, str(lasers), str(boot_s), str(hang_s), str(signals), str(int(not virtual))]
        # -P excludes the current folder from imports. A new session shields it from the terminal's signals.
        messages = os.open(os.devnull, os.O_WRONLY) if virtual else _open_terminal()
        self._process = subprocess.Popen(  # noqa: S603 - this very program
            [sys.executable, "-P", "-m", "workbench.devices.guardian", *call],
            stdin=commands,
            stdout=answers,
            stderr=messages,
            pass_fds=[signals],
            start_new_session=True,
        )
        for theirs in (commands, answers, signals, messages):
            os.close(theirs)
        self._has_leases = line_type.has_leases
        self.is_open = True
        self._heard = b""
        self._asked = 0
        self._unconfirmed = (
            "the lasers may be on: it was not confirmed that they are off; treat the beams as on"
        )
        """Last reason of the guardian for an unconfirmed off."""
        self._before: int | None = None
        try:
            self.identity = str(self._answer(0, ANSWER_S + boot_s))
        except BaseException:
            self.close()
            raise
        if threading.current_thread() is threading.main_thread():
            # The interpreter's C-level handler writes signal numbers there, independent of Python code.
            self._before = signal.set_wakeup_fd(self._signals, warn_on_full_buffer=False)

    def ask(self, command: str) -> object:
        """Send a command and return its answer.

        Raises:
            WorkbenchError: the guardian reports an error of this class.
            LaserOffNotConfirmedError: the guardian does not answer.
        """
        # Numbered, because a signal may have interrupted the wait for an earlier answer.
        self._asked += 1
        self.send(f"{self._asked} {command}")
        return self._answer(self._asked, ANSWER_S)

    def send(self, command: str) -> None:
        """Send a command without an answer. The next `ask` detects a guardian that has ended."""
        if not self.is_open:
            raise ValueError("the client is closed: its descriptors may belong to another file now")
        with contextlib.suppress(BrokenPipeError):
            os.write(self._commands, f"{command}\n".encode())

    def close(self) -> None:
        """Have the guardian switch all lasers off and end.

        If the hardware has no leases, a guardian that does not end in time continues to try.

        Raises:
            LaserOffNotConfirmedError: the guardian continues to try, or ended without a confirmed off.
        """
        if not self.is_open:
            return
        self.is_open = False
        if self._before is not None:
            signal.set_wakeup_fd(self._before)
        for ours in (self._signals, self._commands, self._answers):
            os.close(ours)
        try:
            self._wait_for_off()
        except LaserOffNotConfirmedError:
            raise
        except BaseException:
            # A further stop request: an unconfirmed off has priority over it.
            self._wait_for_off()
            raise

    def _wait_for_off(self) -> None:
        try:
            code = self._process.wait(ANSWER_S if self._has_leases else LET_GO_S)
        except subprocess.TimeoutExpired:
            if not self._has_leases:
                # A thread collects its exit status.
                threading.Thread(target=self._process.wait, daemon=True).start()
                raise LaserOffNotConfirmedError(
                    f"{self._unconfirmed}. The guardian (process {self._process.pid}) holds the board and"
                    f" tries again for {TRY_BOARD_S:g} s; then run `workbench lasers off`"
                ) from None
            self._process.kill()
            code = self._process.wait()
        if code not in SAFE_CODES:
            raise LaserOffNotConfirmedError(self._unconfirmed)

    def _answer(self, number: int, wait_s: float) -> object:
        deadline = time.monotonic() + wait_s
        while (answer := self._next_answer(deadline))["to"] != number:
            pass
        if "error" in answer:
            kind: type[WorkbenchError] = getattr(errors, str(answer["error"]))
            if kind is LaserOffNotConfirmedError:
                self._unconfirmed = str(answer["text"])
            raise kind(answer["text"])
        return answer["value"]

    def _next_answer(self, deadline: float) -> dict[str, object]:
        while b"\n" not in self._heard:
            ready, _, _ = select.select([self._answers], [], [], max(0.0, deadline - time.monotonic()))
            received = os.read(self._answers, 4096) if ready else b""
            if not received:
                raise LaserOffNotConfirmedError(
                    f"the guardian of the laser controller {'does not answer' if not ready else 'has ended'};"
                    " the controller's lease ends by itself, but that was not verified: treat the beams as"
                    " on, then run `workbench lasers off`"
                )
            self._heard += received
        line, _, self._heard = self._heard.partition(b"\n")
        answer: dict[str, object] = json.loads(line)
        return answer


def _open_terminal() -> int:
    """Descriptor for messages of the guardian after the end of this process: the terminal, if there is one.

    Not standard error, because the guardian ends later and a reader of that stream would wait for it.
    """
    try:
        return os.open("/dev/tty", os.O_WRONLY | os.O_NOCTTY)
    except OSError:
        return os.open(os.devnull, os.O_WRONLY)
