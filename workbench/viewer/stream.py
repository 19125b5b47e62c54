"""Open recording file with its current position on every timeline."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass
from errno import EIO
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from workbench.viewer.entities import APPLICATION, CAPTURE, STANDOFF, STEP, WALL_CLOCK
from workbench.viewer.rrd import release_unused
from workbench.viewer.window import END, LOOPBACK

FLUSH_SECONDS = 20.0
STALL_S = 60.0
"""Longest time between checks for which a served recording may not grow; a viewer that hangs delays it."""
SERVER_MEMORY = "256MiB"
"""Memory that the server keeps for a viewer that has not yet come."""


@dataclass(frozen=True)
class Moment:
    """Position on all timelines."""

    capture: int
    step: int
    time_ns: int
    standoff_mm: float | None = None
    """Standoff of a measurement at one standoff; None for other events."""


class Stream:
    """Rerun recording that is written to a file while it is logged, and served to a viewer.

    Args:
        path: file of the recording; None: it is only served.
        session: name of the recording.
        layout: first layout.
        port: port on loopback at which a viewer may watch; None: none may. The recording does not wait for a
            viewer: one that hangs, or never comes, costs memory up to a limit.

    Raises:
        OSError: the file cannot be written.
    """

    def __init__(
        self, path: Path | None, session: str, layout: rrb.Blueprint, port: int | None = None
    ) -> None:
        self._path, self._served = path, port is not None
        self._size = 0
        self._stalled_since: float | None = None
        """Time of the first check at which the file had its present size."""
        release_unused()
        self._recording = rr.RecordingStream(
            APPLICATION,
            recording_id=session,
            send_properties=False,
            # The default batcher delays scalars while frames fill its buffer, and loses them in a crash.
            batcher_config=rr.ChunkBatcherConfig.LOW_LATENCY(),
        )
        # No timelines of the logging itself: they would differ in a rebuilt recording.
        rr.set_log_time_enabled(False, self._recording)
        rr.set_log_tick_enabled(False, self._recording)
        # A footer's index grows in memory with every value, by 190 kB a capture; `compact` adds a small one.
        sinks: list[rr.FileSink | rr.GrpcServerSink] = []
        if path is not None:
            sinks.append(rr.FileSink(str(path), write_footer=False))
        if port is not None:
            sinks.append(rr.GrpcServerSink(bind_ip=LOOPBACK, port=port, server_memory_limit=SERVER_MEMORY))
        with self._named():
            self._recording.set_sinks(*sinks, default_blueprint=layout)
        self._recording.send_recording_name(session)
        self._prefix = ""

    def below(self, prefix: str) -> Stream:
        """The same recording with all entities below `prefix`; its layout is that of the whole."""
        part = copy(self)
        part._prefix = f"{prefix}/"
        return part

    def lay_out(self, layout: rrb.Blueprint) -> None:
        """Replace the layout, also in a viewer that shows the recording."""
        if not self._prefix:
            self._recording.send_blueprint(layout)

    def at(self, moment: Moment) -> None:
        """Set the position on the timelines for everything logged afterwards."""
        self._recording.reset_time()
        self._recording.set_time(CAPTURE, sequence=moment.capture)
        self._recording.set_time(STEP, sequence=moment.step)
        self._recording.set_time(WALL_CLOCK, timestamp=np.datetime64(moment.time_ns, "ns"))
        if moment.standoff_mm is not None:
            self._recording.set_time(STANDOFF, sequence=round(moment.standoff_mm))

    def log(self, entity: str, *what: rr.AsComponents, static: bool = False) -> None:
        """Log archetypes at one entity."""
        self._recording.log(f"{self._prefix}{entity}", *what, static=static)

    def log_static_text(self, entity: str, text: str, kind: rr.MediaType = rr.MediaType.TEXT) -> None:
        """Log a text that is the same at every time."""
        self.log(entity, rr.TextDocument(text, media_type=kind), static=True)

    def describe(self, name: str, **values: str | int) -> None:
        """Set properties of the recording."""
        properties = rr.AnyValues(drop_untyped_nones=True, **values)
        self._recording.send_property(f"{self._prefix.replace('/', '_')}{name}", properties)

    def check_written(self) -> None:
        """Raise if the file cannot be written; called now and then, after something was logged.

        A served stream is not flushed, which would wait for a viewer that hangs: its file must grow.

        Raises:
            OSError: the file cannot be written.
        """
        if not self._served or self._path is None:
            self.flush()
            return
        size, now = self._path.stat().st_size, time.monotonic()
        if size != self._size or self._stalled_since is None:
            self._size, self._stalled_since = size, None if size != self._size else now
        elif now - self._stalled_since > STALL_S:
            cause = f"the recording has not grown for {STALL_S:g} s; check the free space of the disk"
            raise OSError(EIO, cause, str(self._path))

    def flush(self) -> None:
        """Write buffered data.

        Raises:
            OSError: the file cannot be written. Logging itself does not report it.
        """
        with self._named():
            self._recording.flush(timeout_sec=FLUSH_SECONDS)

    def close(self) -> None:
        """Write buffered data and the end of the file; raises the errors of `flush`."""
        try:
            self.flush()
        finally:
            self._recording.disconnect()
        if self._path is not None:
            with self._path.open("ab") as file:
                file.write(END)

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Errors of Rerun as errors of the file."""
        try:
            yield
        except RuntimeError as error:
            cause = f"the recording has failed ({error}); check the free space of the disk"
            raise OSError(EIO, cause, str(self._path)) from error
