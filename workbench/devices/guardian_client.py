"""The workbench's end of the guardian: start it, exchange commands and answers, pass signals on to it."""

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

ANSWER_S = 10.0
"""Longest time to wait for an answer, s: twice two requests of a second, and a busy computer."""
LET_GO_S = 3.0
"""Time for a guardian to end where no lease ends an emission and the off is not confirmed, s."""
DARK = {0, BadInputError.exit_code, RigNotReadyError.exit_code}
"""A guardian's exit codes that need no warning: the off was confirmed, or the device could not be opened."""


class GuardianClient:
    """A guardian process, see `guardian.py`. It holds the device until this is closed or its process ends."""

    def __init__(
        self,
        line_type: type[GuardedLine],
        settings: DeviceBlock,
        lasers: int,
        boot_s: float,
        hang_s: float,
        virtual: bool = False,
    ) -> None:
        """Start it, and wait until every laser is off.

        Args:
            line_type: the laser driver.
            settings: its block of the rig file.
            lasers: number of lasers.
            boot_s: time in which the device has to answer, s.
            hang_s: time without a beat after which lasers go off, s.
            virtual: whether the beams are simulated: the guardian then writes nothing to the terminal.

        Raises:
            BadInputError: the device has fewer outputs than there are `lasers`.
            RigNotReadyError: no such device, another program holds it, or it could not be identified and
                confirmed that all are off.
            LaserOffNotConfirmedError: the device was opened, and does not confirm that all are off.
        """
        commands, self._commands = os.pipe()
        self._answers, answers = os.pipe()
        signals, self._signals = os.pipe()
        os.set_blocking(self._signals, False)
        line = [line_reference(line_type), settings.model_dump_json(by_alias=True, exclude_unset=True)]
        call = [*line, str(lasers), str(boot_s), str(hang_s), str(signals)]
        # -P: what lies in the current folder is not imported. A session of its own: no terminal reaches it.
        said = os.open(os.devnull, os.O_WRONLY) if virtual else _last_words()
        self._process = subprocess.Popen(  # noqa: S603 - this very program
            [sys.executable, "-P", "-m", "workbench.devices.guardian", *call],
            stdin=commands,
            stdout=answers,
            stderr=said,
            pass_fds=[signals],
            start_new_session=True,
        )
        for theirs in (commands, answers, signals, said):
            os.close(theirs)
        self._has_leases = line_type.has_leases
        self.is_open = True
        self._heard = b""
        self._asked = 0
        self._unconfirmed = (
            "the lasers may be on: it was not confirmed that they are off; treat the beams as on"
        )
        """Reason that the guardian gave last for an off that was not confirmed."""
        self._before: int | None = None
        try:
            self.identity = str(self._answer(0, ANSWER_S + boot_s))
        except BaseException:
            self.close()
            raise
        if threading.current_thread() is threading.main_thread():
            # The interpreter's C-level handler writes a signal's number there, whatever Python code is at.
            self._before = signal.set_wakeup_fd(self._signals, warn_on_full_buffer=False)

    def ask(self, command: str) -> object:
        """The answer to a command.

        Raises:
            WorkbenchError: what the guardian could not do, by its name.
            LaserOffNotConfirmedError: the guardian does not answer.
        """
        # Numbered: a signal may have raised while an earlier answer was awaited, which is still to come.
        self._asked += 1
        self.tell(f"{self._asked} {command}")
        return self._answer(self._asked, ANSWER_S)

    def tell(self, command: str) -> None:
        """A command without an answer. A guardian that is gone shows at the next `ask`."""
        if not self.is_open:
            raise ValueError("the guardian was let go: its descriptors may belong to another file now")
        with contextlib.suppress(BrokenPipeError):
            os.write(self._commands, f"{command}\n".encode())

    def close(self) -> None:
        """Let it go: it switches everything off and ends.

        Where no lease of the hardware ends an emission, a guardian that does not end is left trying.

        Raises:
            LaserOffNotConfirmedError: it is, or it ended without having confirmed that all are off.
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
            # Another stop was asked for. An off that is not confirmed counts more than that.
            self._wait_for_off()
            raise

    def _wait_for_off(self) -> None:
        try:
            code = self._process.wait(ANSWER_S if self._has_leases else LET_GO_S)
        except subprocess.TimeoutExpired:
            if not self._has_leases:
                # Its exit status has to be collected.
                threading.Thread(target=self._process.wait, daemon=True).start()
                raise LaserOffNotConfirmedError(
                    f"{self._unconfirmed}. The guardian (process {self._process.pid}) goes on trying for some"
                    f" {TRY_BOARD_S:g} s, and holds the board as long; then run `workbench lasers off`"
                ) from None
            self._process.kill()
            code = self._process.wait()
        if code not in DARK:
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
            came = os.read(self._answers, 4096) if ready else b""
            if not came:
                raise LaserOffNotConfirmedError(
                    f"the guardian of the laser controller {'does not answer' if not ready else 'is gone'};"
                    " a controller's lease ends by itself, but nobody verified it: treat the beams as on,"
                    " then run `workbench lasers off`"
                )
            self._heard += came
        line, _, self._heard = self._heard.partition(b"\n")
        answer: dict[str, object] = json.loads(line)
        return answer


def _last_words() -> int:
    """Descriptor for what the guardian has to say after this process ended: the terminal, if there is one.

    Not our standard error: the guardian outlives us, and a reader of that stream would wait for its end.
    """
    try:
        return os.open("/dev/tty", os.O_WRONLY | os.O_NOCTTY)
    except OSError:
        return os.open(os.devnull, os.O_WRONLY)
