"""One open recording file, and the place on every timeline at which the next thing is logged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from workbench.viewer.entities import APPLICATION, CAPTURE, STANDOFF, STEP, WALL_CLOCK

FLUSH_SECONDS = 20.0


@dataclass(frozen=True)
class Moment:
    """Where on the timelines something happened."""

    capture: int
    step: int
    time_ns: int
    standoff_mm: float | None = None
    """Only for what was measured at one standoff."""


class Stream:
    """A Rerun recording written to a file as things are logged."""

    def __init__(self, path: Path, session: str, layout: rrb.Blueprint) -> None:
        self._recording = rr.RecordingStream(
            APPLICATION,
            recording_id=session,
            send_properties=False,
            # The default batcher holds scalars back while frames fill its buffer, and loses them in a crash.
            batcher_config=rr.ChunkBatcherConfig.LOW_LATENCY(),
        )
        # What is logged must be the same whenever it is logged, or a rebuilt recording would differ.
        rr.set_log_time_enabled(False, self._recording)
        rr.set_log_tick_enabled(False, self._recording)
        self._recording.set_sinks(rr.FileSink(str(path)), default_blueprint=layout)
        self._recording.send_recording_name(session)

    def lay_out(self, layout: rrb.Blueprint) -> None:
        """Replace the layout, also in a viewer that is showing the recording."""
        self._recording.send_blueprint(layout)

    def at(self, moment: Moment) -> None:
        """Everything logged from here on happened at `moment`."""
        self._recording.reset_time()
        self._recording.set_time(CAPTURE, sequence=moment.capture)
        self._recording.set_time(STEP, sequence=moment.step)
        self._recording.set_time(WALL_CLOCK, timestamp=np.datetime64(moment.time_ns, "ns"))
        if moment.standoff_mm is not None:
            self._recording.set_time(STANDOFF, sequence=round(moment.standoff_mm))

    def log(self, entity: str, *what: rr.AsComponents, static: bool = False) -> None:
        """Log archetypes at one entity."""
        self._recording.log(entity, *what, static=static)

    def curve(self, entity: str, values: Mapping[int, float]) -> None:
        """Log a series over the timeline of standoffs alone, from whole millimetres to values."""
        if values:
            self._recording.send_columns(
                entity,
                indexes=[rr.TimeColumn(STANDOFF, sequence=list(values))],
                columns=rr.Scalars.columns(scalars=list(values.values())),
            )

    def describe(self, name: str, **values: str | int) -> None:
        """Properties of the recording as a whole."""
        self._recording.send_property(name, rr.AnyValues(drop_untyped_nones=True, **values))

    def close(self) -> None:
        """Write what is still buffered and the file's footer."""
        self._recording.flush(timeout_sec=FLUSH_SECONDS)
        self._recording.disconnect()
