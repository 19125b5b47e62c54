"""Records of a session as values in a recording: what each event logs, and where on the timelines."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from functools import singledispatchmethod
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from workbench.model import event as ev
from workbench.model.arrays import Image
from workbench.model.calibration import load_calibration
from workbench.model.errors import BadInputError
from workbench.model.number_text import counted
from workbench.model.prompt import Prompt
from workbench.model.reading_text import reading_remark
from workbench.model.rig import Rig
from workbench.model.spot import Failure, Spot
from workbench.model.target import Placement, WorldTarget
from workbench.viewer import documents, fit, frame, scene, steps, world_view
from workbench.viewer import entities as at
from workbench.viewer.advice import AdviceView
from workbench.viewer.blueprint import Phase, blueprint
from workbench.viewer.captures import CaptureLog, capture_record
from workbench.viewer.crops import Crops
from workbench.viewer.geometry import Geometry, expected_ellipses, expected_spots
from workbench.viewer.stored_frames import StoredFrames
from workbench.viewer.stream import Moment, Stream
from workbench.viewer.trial import TrialView, tabs

OF_NO_STANDOFF = (
    ev.ProcedureStarted,
    ev.StepStarted,
    ev.FitFinished,
    ev.CalibrationExported,
    ev.CalibrationLoaded,
    ev.SessionFinished,
)
"""Events between placements. At the standoff of the last one they would cover what was captured there."""


class OpenRecording:
    """Open recording, with the state that later records need."""

    def __init__(self, stream: Stream, session_dir: Path, rig: Rig) -> None:
        self.stream = stream
        self._session_dir = session_dir
        self._stored = StoredFrames(session_dir)
        self._rig = rig
        self._colors = at.laser_colors(rig.laser_ids)
        self._geometry = Geometry.of_rig(rig)
        self._crops = Crops(stream, self._colors)
        self._advice = AdviceView(stream)
        self._trials: list[TrialView] = []
        self._placement: Placement | None = None
        self._captures = CaptureLog()
        self._exposure = Moment(0, 0, 0)
        self._frames: tuple[Image, Image | None] | None = None
        self._shown: tuple[str, str] | None = None
        """Path and checksum of the frame, lasers on, that the recording shows."""
        self._spots: tuple[Spot, ...] = ()
        self._title = ""
        self._step = ""
        self._calibrates = False
        self._has_world = False
        self._lasers: tuple[ev.LaserRange, ...] = ()
        """Ranges of the last reading."""
        self._live = True
        self._phase: Phase = "capture"
        self._length = ""
        self._states: dict[str, tuple[str, int, float | None]] = {}
        """Last state of a lane, with its step and standoff."""
        self._capture = 1
        self._steps = 0

    def take(self, record: ev.Record) -> None:
        """Log one record at its position on the timelines."""
        self._advance(record.event)
        placement = None if isinstance(record.event, OF_NO_STANDOFF) else self._placement
        standoff_mm = None if placement is None else placement.standoff_mm
        moment = Moment(self._capture, max(self._steps, 1), record.time_ns, standoff_mm)
        self.stream.at(moment)
        self._log(record.event, moment)

    def _advance(self, event: object) -> None:
        """Count captures and steps, and note the placement.

        Preparations of a capture (a step, a placement) have the number of the next capture. With the number
        of the previous one, the last picture of a standoff would show the target of the next standoff.
        """
        taken = len(self._captures.numbers)
        if isinstance(event, ev.StepStarted):
            self._steps += 1
        if isinstance(event, ev.TargetPlaced):
            self._placement = event.placement
        if isinstance(event, ev.CaptureTaken | ev.StepStarted | ev.TargetPlaced):
            self._capture = taken + 1

    @singledispatchmethod
    def _log(self, event: object, moment: Moment) -> None:
        raise TypeError(f"no handler for {type(event).__name__}")

    @_log.register
    def _(self, event: ev.SessionStarted, moment: Moment) -> None:
        rig = self._rig
        self.stream.describe("session", id=event.session, rig=event.rig, serial=rig.serial)
        self._show_sensor()
        frame.log_series_styles(self.stream, self._colors)
        self._advice.start()
        fit.log_series_styles(self.stream, self._colors)
        fit.log_no_fit_yet(self.stream)
        self._crops.log_none()
        steps.log_text(self.stream, f"Session {event.session} on {event.rig}: {', '.join(event.procedures)}")

    @_log.register
    def _(self, event: ev.ProcedureStarted, moment: Moment) -> None:
        self._length = f" of {event.steps}"
        steps.lane(self.stream, at.LANE_PROCEDURE, event.procedure)
        steps.log_text(self.stream, f"{event.procedure}: {event.title} ({event.length})")

    @_log.register
    def _(self, event: ev.StepStarted, moment: Moment) -> None:
        self._title = event.title
        self._step = f"**Step {event.index}{self._length}: {event.title}**"
        self.show_task()
        self._note(f"**{event.title}**")
        steps.lane(self.stream, at.LANE_STEP, event.title)
        if event.shots == 0:
            self._lane(at.LANE_LASER, steps.LASERS_OFF, moment)
        steps.log_text(self.stream, f"Step {event.index}: {event.title}")

    @_log.register
    def _(self, event: ev.StepFinished, moment: Moment) -> None:
        steps.log_text(self.stream, f"Step {event.index} done: {event.outcome}")

    @_log.register
    def _(self, event: ev.TargetPlaced, moment: Moment) -> None:
        self.show_task()
        self._show_sensor()
        self._crops.log_none()
        if isinstance(event.placement.target, WorldTarget):
            world_view.log_world(self.stream, event.placement.target)
            if not self._has_world:
                self._has_world = True
                self._lay_out(self._phase)
        frame.log_predicted(self.stream, expected_spots(self._geometry, self._placement), self._colors)
        frame.log_predicted_ellipses(
            self.stream, expected_ellipses(self._geometry, self._placement), self._colors
        )
        steps.log_text(self.stream, f"Target placed at {event.placement.standoff_mm:g} mm")

    @_log.register
    def _(self, event: ev.Answered, moment: Moment) -> None:
        self.show_task()
        answer = event.answer
        text = answer.action if answer.value is None else answer.value
        steps.log_text(self.stream, f"{event.question} {text} {answer.reason or ''}".rstrip())

    @_log.register
    def _(self, event: ev.PlacementFinished, moment: Moment) -> None:
        steps.lane(self.stream, at.LANE_DARK, "no beam stuck")

    @_log.register
    def _(self, event: ev.SetAside, moment: Moment) -> None:
        steps.log_text(self.stream, f"Placement {event.text}", steps.WARN)

    @_log.register
    def _(self, event: ev.SessionResumed, moment: Moment) -> None:
        steps.log_text(self.stream, f"Resumed by {event.operator} at {event.created}", steps.WARN)

    @_log.register
    def _(self, event: ev.SessionRepaired, moment: Moment) -> None:
        steps.log_text(self.stream, f"Repair by {event.operator}: {event.text}", steps.WARN)

    @_log.register
    def _(self, event: ev.Incident, moment: Moment) -> None:
        steps.log_text(self.stream, f"{event.of} failed: {event.message}", steps.WARN)

    @_log.register
    def _(self, event: ev.CaptureTaken, moment: Moment) -> None:
        self._exposure = Moment(moment.capture, moment.step, event.on.time_ns, event.standoff_mm)
        self._captures.add(event, self._placement, self._exposure)
        if event.purpose == "calibration" and not self._calibrates:
            self._calibrates = True
            self._lay_out("capture")
        self.stream.at(self._exposure)
        self._show_frame(event)
        self.stream.log(at.CAPTURE_RECORD, rr.AnyValues(drop_untyped_nones=True, **capture_record(event)))
        self._note(documents.capture_line(moment.capture, event, self._title))
        self._lane(at.LANE_LASER, event.laser_id, self._exposure)

    @_log.register
    def _(self, event: ev.SpotsFound, moment: Moment) -> None:
        capture = self._captures.taken[event.key]
        placement = self._captures.placements[event.key]
        exposure = self._captures.moments[event.key]
        self.stream.at(exposure)
        self._spots = event.spots
        if capture.laser_id in self._colors:
            self._captures.spots[event.key] = event.spots
        frame.log_spots(self.stream, event.spots, self._colors, self._rig.camera.height_px)
        if capture.laser_id in self._colors:
            self._show_crops(event.spots, [capture.laser_id])
        saturated = any(Failure.SATURATED in spot.flags for spot in event.spots)
        self._lane(at.LANE_SATURATION, "saturated" if saturated else "no pixel saturated", exposure)
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
        steps.log_text(self.stream, f"Camera latency: {counted(event.frames, 'frame')}")

    @_log.register
    def _(self, event: ev.ExposureSet, moment: Moment) -> None:
        steps.log_text(self.stream, event.text, steps.INFO if event.verdict == "good" else steps.WARN)
        steps.lane(self.stream, at.LANE_EXPOSURE, f"{event.exposure:g} {event.unit}".rstrip())

    @_log.register
    def _(self, event: ev.StandoffAdvised, moment: Moment) -> None:
        steps.log_text(self.stream, f"After {counted(event.placements, 'placement')}, {event.text}")
        self._advice.take(event)

    @_log.register
    def _(self, event: ev.FitFinished, moment: Moment) -> None:
        self._geometry = self._geometry.fitted(event.parameters)
        self._show_sensor()
        fit.log_fit(self.stream, event, self._captures, moment, self._colors)
        self._calibrates = True
        self._lay_out("fit")
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
        with suppress(BadInputError):  # moved or edited since: the fit's values stay, without a covariance
            self._geometry = self._geometry.calibrated(load_calibration(self._session_dir / event.path))
        steps.log_text(self.stream, f"Calibration written to {event.path}")

    @_log.register
    def _(self, event: ev.CalibrationLoaded, moment: Moment) -> None:
        calibration = load_calibration(self._session_dir / event.path)
        self._geometry = self._geometry.calibrated(calibration)
        self._show_sensor()
        steps.log_text(self.stream, event.text)

    @_log.register
    def _(self, event: ev.ReadingTaken, moment: Moment) -> None:
        self.stream.at(self._exposure)
        spots = frame.assigned(self._spots, event.lasers)
        frame.log_assigned(self.stream, self._spots, spots, self._colors, self._rig.camera.height_px)
        self._show_crops(spots, [laser for laser in self._colors if laser not in event.left_off])
        if self._placement is not None:
            scene.log_ranged(self.stream, event.lasers, self._placement, self._geometry, self._colors)
        self._lasers = event.lasers
        self._trial(event.trial).take(event, self._exposure)
        self.stream.at(moment)
        if remark := reading_remark(event):
            steps.log_text(self.stream, remark, steps.WARN)

    @_log.register
    def _(self, event: ev.VehicleMoved, moment: Moment) -> None:
        self.stream.at(self._exposure)
        if self._placement is not None and isinstance(self._placement.target, WorldTarget):
            vehicle = self._placement.target.vehicle
            world_view.log_step(self.stream, event, vehicle, self._lasers, self._geometry, self._colors)

    @_log.register
    def _(self, event: ev.TrialFinished, moment: Moment) -> None:
        trial = self._trial(event.trial)
        trial.finish(event)
        self.stream.at(moment)
        self._lay_out("trial")
        steps.log_text(self.stream, f"Trial {event.trial} finished, {counted(len(event.tables), 'table')}")

    @_log.register
    def _(self, event: ev.TrialProgress, moment: Moment) -> None:
        steps.log_text(self.stream, event.text)

    @_log.register
    def _(self, event: ev.SessionFinished, moment: Moment) -> None:
        self.stream.log_static_text(at.TASK, "Session ended")
        self._live = False
        self._lay_out(self._phase)
        for trial in self._trials:
            trial.stop()
        self.stream.at(moment)
        steps.end_all(self.stream)
        level = steps.INFO if event.exit_code == 0 else steps.ERROR
        steps.log_text(self.stream, f"Session ended ({event.exit_code}): {event.message}", level)

    def _trial(self, name: str) -> TrialView:
        """View of a trial; the first mention adds its tab."""
        for trial in self._trials:
            if trial.trial == name:
                return trial
        trial = TrialView(self.stream, self._colors, name)
        trial.start()
        self._trials.append(trial)
        self._lay_out("trial")
        return trial

    def show_task(self, prompt: Prompt | None = None) -> None:
        """Show the present step, and below it an open prompt."""
        text = documents.task_text(self._step, prompt)
        self.stream.log_static_text(at.TASK, text, rr.MediaType.MARKDOWN)

    def _lay_out(self, phase: Phase) -> None:
        """Send the layout with a screen in front."""
        self._phase = phase
        self.stream.lay_out(self.layout)

    @property
    def layout(self) -> rrb.Blueprint:
        """Present layout."""
        return blueprint(
            self._rig,
            tabs(self._trials),
            self._phase,
            captures=bool(self._captures.numbers),
            calibrates=self._calibrates,
            live=self._live,
            world=self._has_world,
        )

    def _lane(self, entity: str, state: str, moment: Moment) -> None:
        """Log the state of a lane where it is not that of the same step and standoff just before."""
        now = state, moment.step, moment.standoff_mm
        if self._states.get(entity) != now:
            self._states[entity] = now
            steps.lane(self.stream, entity, state)

    def _note(self, markdown: str) -> None:
        self.stream.log(at.NOW, rr.TextDocument(markdown, media_type=rr.MediaType.MARKDOWN))

    def _show_sensor(self) -> None:
        """Log camera, rays and scanlines with the present parameters."""
        scene.log_camera(self.stream, self._rig.camera, self._geometry)
        if self._placement is not None:
            scene.log_placement(self.stream, self._placement, self._geometry, self._colors)
        lines = {laser: self._geometry.scanline(laser, self._rig.bench.reach_mm) for laser in self._colors}
        frame.log_scanlines(self.stream, lines, self._colors)

    def _show_frame(self, event: ev.CaptureTaken) -> None:
        """Log the frame of a capture with lasers on, once where several lasers share it.

        A row of a captures file may state positions without any frame.
        """
        if not event.on.path:
            self._frames = self._shown = None
            return
        if (shown := (event.on.path, event.on.sha256)) == self._shown:
            return
        self._shown = shown
        png, on = self._stored.image(event.on)
        off = None if event.off is None else self._stored.pixels(event.off)
        self._frames = on, off
        ambient_dn = frame.median_dn(on if off is None else off)
        full_scale = 2**self._rig.camera.bits - 1
        frame.log_frame(self.stream, png, None if off is None else ambient_dn, full_scale)
        frame.log_ambient(self.stream, ambient_dn)

    def _show_crops(self, spots: Sequence[Spot], lasers: Sequence[str]) -> None:
        if self._frames is not None:
            expected = expected_spots(self._geometry, self._placement, lasers)
            self._crops.take(*self._frames, spots, expected)
