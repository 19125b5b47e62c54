"""Recording of a session for the Rerun viewer, made from the session's records and frames.

Journal and frames are the record. A damaged or incomplete recording can be made again from them.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import singledispatchmethod
from hashlib import sha256
from pathlib import Path
from types import TracebackType

from workbench.model import event as ev
from workbench.model.calibration import load_calibration
from workbench.model.errors import BadInputError
from workbench.model.reading_text import reading_remark
from workbench.model.rig import Rig
from workbench.model.spot import Spot
from workbench.model.target import Placement
from workbench.viewer import camera, fit, scene, steps
from workbench.viewer import entities as at
from workbench.viewer.blueprint import blueprint
from workbench.viewer.geometry import Geometry
from workbench.viewer.stream import Moment, Stream
from workbench.viewer.trial import TrialView

RECORDING_FILE = "recording.rrd"


class RecordingConsumer:
    """Consumer that writes `recording.rrd` into the session folder.

    The first record replaces an existing recording; a resumed session therefore passes all earlier records
    first. Use the consumer as a context manager, or call `close`. Without that only the footer of the file is
    missing (`rerun rrd merge` adds it).

    Raises:
        BadInputError: a frame of a record is missing in the session folder, or has changed.
    """

    def __init__(self, session_dir: Path, rig: Rig, out: Path | None = None) -> None:
        self._session_dir = session_dir
        self._rig = rig
        self._out = out or session_dir / RECORDING_FILE
        self._colors = at.laser_colors(rig.laser_ids)
        self._open: _OpenRecording | None = None

    def __call__(self, record: ev.Record) -> None:
        """Log one record. The first one must be `SessionStarted`, which names the recording."""
        if self._open is None:
            if not isinstance(record.event, ev.SessionStarted):
                raise ValueError(f"expected session_started as the first record, got {record.event.kind}")
            stream = Stream(self._out, record.event.session, blueprint(self._rig))
            self._open = _OpenRecording(stream, self._session_dir, self._rig)
        self._open.take(record)

    def close(self) -> None:
        """Flush and close the file; a second call has no effect."""
        if self._open is not None:
            self._open.stream.close()
            self._open = None

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


class _OpenRecording:
    """Open recording, with the state that later records need."""

    def __init__(self, stream: Stream, session_dir: Path, rig: Rig) -> None:
        self.stream = stream
        self._session_dir = session_dir
        self._rig = rig
        self._colors = at.laser_colors(rig.laser_ids)
        self._geometry = Geometry.of_rig(rig)
        self._trial = TrialView(stream, rig, self._colors)
        self._placement: Placement | None = None
        self._captures: dict[str, tuple[int, ev.CaptureTaken, Placement | None]] = {}
        self._exposure = Moment(0, 0, 0)
        self._spots: tuple[Spot, ...] = ()
        self._capture = 0
        self._step = 0

    def take(self, record: ev.Record) -> None:
        """Log one record at its position on the timelines."""
        self._advance(record.event)
        moment = Moment(self._capture, self._step, record.time_ns)
        self.stream.at(moment)
        self._log(record.event, moment)

    def _advance(self, event: object) -> None:
        """Count captures and steps.

        Preparations of a capture (a step, a placement) have the number of the next capture. With the number
        of the previous one, the last picture of a standoff would show the target of the next standoff.
        """
        taken = len(self._captures)
        if isinstance(event, ev.StepStarted):
            self._step += 1
        if isinstance(event, ev.CaptureTaken | ev.StepStarted | ev.TargetPlaced):
            self._capture = taken + 1

    @singledispatchmethod
    def _log(self, event: object, moment: Moment) -> None:
        raise TypeError(f"no handler for {type(event).__name__}")

    @_log.register
    def _(self, event: ev.SessionStarted, moment: Moment) -> None:
        rig = self._rig
        self.stream.describe("session", id=event.session, rig=event.rig, serial=rig.serial)
        scene.log_styles(self.stream)
        scene.log_sensor(self.stream, rig.camera, self._geometry, self._colors)
        camera.log_series_styles(self.stream, self._colors)
        fit.log_no_fit_yet(self.stream)
        self._trial.log_none_yet()
        steps.log_text(self.stream, f"Session {event.session} on {event.rig}: {', '.join(event.procedures)}")

    @_log.register
    def _(self, event: ev.ProcedureStarted, moment: Moment) -> None:
        steps.lane(self.stream, at.LANE_PROCEDURE, event.procedure)
        steps.log_text(self.stream, f"{event.procedure}: {event.title} ({event.length})")

    @_log.register
    def _(self, event: ev.StepStarted, moment: Moment) -> None:
        steps.lane(self.stream, at.LANE_STEP, event.title)
        if event.shots == 0:
            steps.lane(self.stream, at.LANE_LASER, steps.LASERS_OFF)
        steps.log_text(self.stream, f"Step {event.index}: {event.title}")

    @_log.register
    def _(self, event: ev.StepFinished, moment: Moment) -> None:
        steps.log_text(self.stream, f"Step {event.index} done: {event.outcome}")

    @_log.register
    def _(self, event: ev.TargetPlaced, moment: Moment) -> None:
        self._placement = event.placement
        scene.log_target(self.stream, event.placement, self._geometry)
        steps.log_text(self.stream, f"Target placed at {event.placement.standoff_mm:g} mm")

    @_log.register
    def _(self, event: ev.Answered, moment: Moment) -> None:
        answer = event.answer
        text = answer.action if answer.value is None else answer.value
        steps.log_text(self.stream, f"{event.question} {text} {answer.reason or ''}".rstrip())

    @_log.register
    def _(self, event: ev.PlacementFinished, moment: Moment) -> None:
        """Nothing to show: only a resumed session uses this event."""

    @_log.register
    def _(self, event: ev.SetAside, moment: Moment) -> None:
        steps.log_text(self.stream, f"Placement {event.text}", steps.WARN)

    @_log.register
    def _(self, event: ev.SessionResumed, moment: Moment) -> None:
        steps.log_text(self.stream, f"Resumed by {event.operator} at {event.created}", steps.WARN)

    @_log.register
    def _(self, event: ev.CaptureTaken, moment: Moment) -> None:
        self._captures[event.key] = (moment.capture, event, self._placement)
        self._exposure = Moment(moment.capture, moment.step, event.on.time_ns, event.standoff_mm)
        self.stream.at(self._exposure)
        camera.log_frame(self.stream, self._read(event.on))
        steps.lane(self.stream, at.LANE_LASER, event.laser_id)

    @_log.register
    def _(self, event: ev.SpotsFound, moment: Moment) -> None:
        number, capture, placement = self._captures[event.key]
        self.stream.at(Moment(number, moment.step, capture.on.time_ns, capture.standoff_mm))
        self._spots = event.spots
        camera.log_spots(self.stream, event.spots, self._colors)
        if placement is not None:
            scene.log_spots_on_target(self.stream, event.spots, placement, self._geometry, self._colors)
        for failure in event.failures:
            steps.log_text(self.stream, f"Capture {event.key}: {failure}", steps.WARN)

    @_log.register
    def _(self, event: ev.LimitChecked, moment: Moment) -> None:
        value = "not measured" if event.value is None else f"{event.value:.4g}"
        text = f"{event.of}: {event.quantity} {value}, limit {event.limit}: {event.verdict}"
        steps.log_text(self.stream, text, steps.INFO if event.verdict == "pass" else steps.WARN)

    @_log.register
    def _(self, event: ev.LatencyMeasured, moment: Moment) -> None:
        steps.log_text(self.stream, f"Camera latency: {event.frames} frames")

    @_log.register
    def _(self, event: ev.ExposureSet, moment: Moment) -> None:
        steps.log_text(self.stream, event.text, steps.INFO if event.verdict == "good" else steps.WARN)

    @_log.register
    def _(self, event: ev.StandoffAdvised, moment: Moment) -> None:
        steps.log_text(self.stream, f"After {event.placements} placements, {event.text}")

    @_log.register
    def _(self, event: ev.FitFinished, moment: Moment) -> None:
        self._geometry = self._geometry.fitted(event.parameters)
        scene.log_sensor(self.stream, self._rig.camera, self._geometry, self._colors)
        fit.log_fit(self.stream, event, moment, self._colors)
        good = event.verdict == "accepted"
        steps.log_text(
            self.stream,
            f"Calibration {event.verdict}, residual {event.rms_px:.3f} px rms. {' '.join(event.reasons)}",
            steps.INFO if good else steps.ERROR,
        )
        for warning in event.warnings:
            steps.log_text(self.stream, warning, steps.WARN)

    @_log.register
    def _(self, event: ev.CalibrationExported, moment: Moment) -> None:
        steps.log_text(self.stream, f"Calibration written to {event.path}")

    @_log.register
    def _(self, event: ev.CalibrationLoaded, moment: Moment) -> None:
        calibration = load_calibration(self._session_dir / event.path)
        self._geometry = self._geometry.calibrated(calibration)
        scene.log_sensor(self.stream, self._rig.camera, self._geometry, self._colors)
        steps.log_text(self.stream, event.text)

    @_log.register
    def _(self, event: ev.ReadingTaken, moment: Moment) -> None:
        self.stream.at(self._exposure)
        camera.log_assigned(self.stream, self._spots, event.lasers, self._colors)
        self.stream.at(Moment(moment.capture, moment.step, moment.time_ns, event.standoff_mm))
        self._trial.take(event)
        scene.log_ranged(self.stream, event.lasers, self._geometry, self._colors)
        if remark := reading_remark(event):
            steps.log_text(self.stream, remark, steps.WARN)

    @_log.register
    def _(self, event: ev.TrialFinished, moment: Moment) -> None:
        self._trial.finish(event)
        steps.log_text(self.stream, f"Trial {event.trial} finished, {len(event.tables)} tables")

    @_log.register
    def _(self, event: ev.TrialProgress, moment: Moment) -> None:
        steps.log_text(self.stream, event.text)

    @_log.register
    def _(self, event: ev.SessionFinished, moment: Moment) -> None:
        self._trial.stop()
        steps.end_all(self.stream)
        level = steps.INFO if event.exit_code == 0 else steps.ERROR
        steps.log_text(self.stream, f"Session ended ({event.exit_code}): {event.message}", level)

    def _read(self, frame: ev.FrameRef) -> bytes:
        path = self._session_dir / frame.path
        try:
            png = path.read_bytes()
        except OSError as error:
            raise BadInputError(
                f"{path}: the frame of a journal record cannot be read ({error.strerror}); "
                "restore it from a copy of the session folder"
            ) from None
        # The viewer would show a damaged picture, or none, without an error.
        if sha256(png).hexdigest() != frame.sha256:
            raise BadInputError(
                f"{path}: the frame has changed since it was captured (expected sha256"
                f" {frame.sha256[:12]}...); restore it from a copy of the session folder"
            )
        return png
