"""Recording in a background thread: captures continue if it is slow, fails or hangs."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import TracebackType

from rich.console import Console

from workbench.cli import exit as exit_
from workbench.devices.protocols import Operator
from workbench.model import event as ev
from workbench.model.prompt import Answer, Prompt
from workbench.viewer.recording import RecordingConsumer

PATIENCE_S = 30.0
"""Time limit for closing the recording: Rerun waits forever for a file that cannot be written."""
SETTLE_S = 5.0
"""Longest wait, at the end of a step, for the recording to be written up to there."""
MOST_WAITING = 10_000
"""Largest number of records in the queue."""


@dataclass(frozen=True)
class _Asking:
    """Operator whose prompts are passed on before they are answered."""

    person: Operator
    show: Callable[[Prompt], None]

    def ask(self, prompt: Prompt) -> Answer:
        """See `Operator.ask`."""
        self.show(prompt)
        return self.person.ask(prompt)


class Background:
    """Passes records to the recording in a separate thread.

    The recording ends when a placement is captured again, because its earlier records become void, or when it
    fails. `workbench view` then makes it again from frames and journal.
    """

    def __init__(self, recording: RecordingConsumer, path: Path, console: Console) -> None:
        self._recording, self._path, self._console = recording, path, console
        self._records: queue.Queue[ev.Record | Prompt | threading.Event | None] = queue.Queue(MOST_WAITING)
        self._given_up: str | None = None
        self._failure: str | None = None
        """Failure that is not yet reported to the session."""
        self._thread = threading.Thread(target=self._work, name="recording", daemon=True)

    def __enter__(self) -> Background:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with suppress(queue.Full):
            self._records.put_nowait(None)
        self._thread.join(PATIENCE_S)
        if self._thread.is_alive():
            exit_.hung = True
            self._given_up = "its file cannot be written"
        if self._given_up is None:
            return
        self._path.unlink(missing_ok=True)
        with suppress(OSError):
            self._console.print(
                f"note: the recording is not kept: {self._given_up}; `workbench view` makes it again",
                highlight=False,
                markup=False,
            )

    def __call__(self, record: ev.Record) -> None:
        """Queue one record.

        Raises:
            ConsumerFailedError: the recording has failed since the last record.
        """
        if isinstance(record.event, ev.SetAside):
            self._given_up = "a placement was captured again"
        if self._given_up is None:
            try:
                self._records.put_nowait(record)
            except queue.Full:
                self._fail(f"more than {MOST_WAITING} records were waiting")
            if isinstance(record.event, ev.StepFinished):
                self._settle()
        if self._failure is not None:
            failure, self._failure = self._failure, None
            raise ev.ConsumerFailedError("the recording", failure)

    def asking(self, person: Operator) -> Operator:
        """The operator, whose prompts a viewer shows while they are open."""
        return _Asking(person, self._show_prompt)

    def _show_prompt(self, prompt: Prompt) -> None:
        with suppress(queue.Full):
            self._records.put_nowait(prompt)

    def _settle(self) -> None:
        """Wait until all records are written: a failure after the session's end could not be journalled."""
        settled = threading.Event()
        with suppress(queue.Full):
            self._records.put_nowait(settled)
            settled.wait(SETTLE_S)

    def _work(self) -> None:
        while (item := self._records.get()) is not None:
            if isinstance(item, threading.Event):
                item.set()
            elif isinstance(item, Prompt):
                self._attempt(partial(self._recording.show_prompt, item))
            elif self._given_up is None:
                self._attempt(partial(self._recording, item))
        self._attempt(self._recording.close)

    def _attempt(self, part: Callable[[], None]) -> None:
        """Call a part of the recording; a failure ends it."""
        try:
            part()
        except Exception as error:
            self._fail(str(error))

    def _fail(self, cause: str) -> None:
        exit_.hung = True  # the interpreter's clean-up may wait for the file
        self._failure = self._given_up = cause
