"""Recording of a session for the Rerun viewer, made from the session's records and frames.

Journal and frames are the record. A damaged or incomplete recording can be made again from them.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from pathlib import Path
from types import TracebackType

from workbench.model import event as ev
from workbench.model.prompt import Prompt
from workbench.model.rig import Rig
from workbench.viewer import entities as at
from workbench.viewer.blueprint import blueprint
from workbench.viewer.compaction import compact
from workbench.viewer.open_recording import OpenRecording
from workbench.viewer.stream import Stream
from workbench.viewer.window import free_port

RECORDING_FILE = "recording.rrd"
CHECK_S = 1.0
"""Least time between checks of the file within a step: each waits until everything is written."""


class RecordingConsumer:
    """Consumer that writes `recording.rrd` into the session folder.

    With `watch` the recording is also served on loopback, and `watch` is called with the port.

    The first record replaces an existing recording; a resumed session therefore passes all earlier records
    first. Use the consumer as a context manager, or call `close`. Without that only the footer of the file is
    missing (`rerun rrd merge` adds it).

    Raises:
        BadInputError: a frame of a record is missing in the session folder, or has changed.
        OSError: the file cannot be written (disk full); found within a second, or at the end of the step.
    """

    def __init__(
        self, session_dir: Path, rig: Rig, out: Path | None = None, watch: Callable[[int], None] | None = None
    ) -> None:
        self._session_dir = session_dir
        self._watch = watch
        self._rig = rig
        self._out = out or session_dir / RECORDING_FILE
        self._colors = at.laser_colors(rig.laser_ids)
        self._open: OpenRecording | None = None
        self._checked_s = 0.0

    def __call__(self, record: ev.Record) -> None:
        """Log one record. The first one must be `SessionStarted`, which names the recording."""
        if self._open is None:
            if not isinstance(record.event, ev.SessionStarted):
                raise ValueError(f"expected session_started as the first record, got {record.event.kind}")
            port = None if self._watch is None else free_port()
            stream = Stream(
                self._out, record.event.session, blueprint(self._rig, calibrates=False, live=True), port
            )
            self._open = OpenRecording(stream, self._session_dir, self._rig)
            if self._watch is not None and port is not None:
                self._watch(port)
        self._open.take(record)
        now_s = time.monotonic()
        is_due = isinstance(record.event, ev.SpotsFound) and now_s - self._checked_s > CHECK_S
        if is_due or isinstance(record.event, ev.StepFinished):
            self._checked_s = now_s
            self._open.stream.check_written()

    def show_prompt(self, prompt: Prompt) -> None:
        """Show an open prompt until the next event; it is not kept in the recording."""
        if self._open is not None:
            self._open.show_task(prompt)

    def close(self) -> None:
        """Flush, close and compact the file; a second call has no effect.

        Raises:
            OSError: the file cannot be written.
        """
        recording, self._open = self._open, None
        if recording is not None:
            recording.stream.close()
            compact(self._out, recording.layout)

    def __enter__(self) -> RecordingConsumer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def rebuild(session_dir: Path, rig: Rig, records: Iterable[ev.Record], out: Path) -> None:
    """Make the recording again from the records of a session; only a complete one replaces `out`.

    Raises:
        BadInputError: a frame of a record is missing in the session folder, or has changed.
    """
    partial = out.with_name(out.name + ".partial")
    try:
        with RecordingConsumer(session_dir, rig, partial) as consumer:
            for record in records:
                consumer(record)
        partial.replace(out)
    finally:
        partial.unlink(missing_ok=True)
