"""Recording in a background thread: captures continue if it is slow, fails or hangs."""

from __future__ import annotations

import queue
import threading
from contextlib import suppress
from pathlib import Path
from types import TracebackType

from rich.console import Console

from workbench.cli import exit as exit_
from workbench.model import event as ev
from workbench.viewer.recording import RecordingConsumer

PATIENCE_S = 30.0
"""Time limit for closing the recording: Rerun waits forever for a file that cannot be written."""
MOST_WAITING = 10_000
"""Largest number of records in the queue."""


class Background:
    """Passes records to the recording in a separate thread.

    The recording ends when a placement is captured again, because its earlier records become void, or when it
    fails. `workbench view` then makes it again from frames and journal.
    """

    def __init__(self, recording: RecordingConsumer, path: Path, console: Console) -> None:
        self._recording, self._path, self._console = recording, path, console
        self._records: queue.Queue[ev.Record | None] = queue.Queue(MOST_WAITING)
        self._given_up: str | None = None
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
        if self._given_up is not None:
            self._path.unlink(missing_ok=True)
            with suppress(OSError):
                self._console.print(
                    f"note: the recording is not kept: {self._given_up}; `workbench view` makes it again",
                    highlight=False,
                    markup=False,
                )

    def __call__(self, record: ev.Record) -> None:
        """Queue one record."""
        if isinstance(record.event, ev.SetAside):
            self._given_up = "a placement was captured again"
        if self._given_up is None:
            with suppress(queue.Full):
                self._records.put_nowait(record)
                return
            self._given_up = f"more than {MOST_WAITING} records were waiting"

    def _work(self) -> None:
        try:
            while (record := self._records.get()) is not None:
                if self._given_up is None:
                    self._recording(record)
            self._recording.close()
        except Exception as error:
            self._given_up = str(error)
