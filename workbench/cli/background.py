"""The recording, made beside the session: it may be slow, fail or hang, and the captures go on."""

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
"""The viewer's library waits without end for a file that cannot be written; this is how long we do."""
MOST_WAITING = 10_000


class Background:
    """Hands records to the recording in a thread of its own.

    Where a placement is captured again, its records count no more: the recording ends there, and `workbench
    view` makes it again from frames and journal, as it does where it failed.
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
                    f"note: no recording is kept: {self._given_up}; `workbench view` makes it again",
                    highlight=False,
                    markup=False,
                )

    def __call__(self, record: ev.Record) -> None:
        """Have one record shown."""
        if isinstance(record.event, ev.SetAside):
            self._given_up = "a placement was captured again"
        if self._given_up is None:
            with suppress(queue.Full):
                self._records.put_nowait(record)
                return
            self._given_up = "it does not keep up"

    def _work(self) -> None:
        try:
            while (record := self._records.get()) is not None:
                if self._given_up is None:
                    self._recording(record)
            self._recording.close()
        except Exception as error:
            self._given_up = str(error)
