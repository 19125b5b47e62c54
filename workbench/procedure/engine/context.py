"""Context of a running procedure: bench, session and results so far."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from workbench.calibration.data.spot_rows import own_spots, sought
from workbench.devices.protocols import Bench, Operator, StreamingCamera
from workbench.model import event as ev
from workbench.model.arrays import Image
from workbench.model.calibration import Calibration, Provenance
from workbench.model.errors import RigNotReadyError, StoppedError
from workbench.model.head_calibration import HeadCalibration
from workbench.model.prompt import Answer, Prompt
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.procedure.capture.automatic import find_automatic_control
from workbench.procedure.capture.latency import count_latency
from workbench.procedure.capture.pair import PairSource, spots_found
from workbench.procedure.engine.prompts import safety_prompt
from workbench.procedure.engine.replay import ReplayingJournal
from workbench.procedure.engine.step import Step
from workbench.spots import Finding, Scanline, find_spots

if TYPE_CHECKING:  # types of results: checking a file must not import the solver
    from workbench.calibration.data.boards import BoardView
    from workbench.model.fit_event import CrossValidatedPlacement, Rejected


@dataclass
class Context:
    """Bench, session and results so far; passed from step to step."""

    session_dir: Path
    rig: Rig
    bench: Bench
    operator: Operator
    recorder: ReplayingJournal
    provenance: Provenance
    stopping: Callable[[], str | None]
    """Called between captures; a text is the reason to end the session."""
    captures: list[ev.CaptureTaken] = field(default_factory=list)
    findings: dict[str, Finding] = field(default_factory=dict)
    """Spots by capture key."""
    boards: dict[str, BoardView | Rejected] = field(default_factory=dict)
    """Views of the printed board by placement key."""
    steps: Sequence[Step] = ()
    """Steps of the present procedure."""
    step_index: int = 0
    """Index of the present step in `steps`, from 0."""
    accepted: Calibration | None = None
    """Calibration of the last accepted fit."""
    cross_validation: tuple[CrossValidatedPlacement, ...] = ()
    """Cross-validation of the last accepted fit, by placement."""
    calibration: Calibration | None = None
    """Exported or existing calibration, used by trials."""
    head: HeadCalibration | None = None
    """Calibration of the scanning head, used by scans."""
    readings: list[ev.ReadingTaken] = field(default_factory=list)
    """Readings of all trials so far, for steps that compare trials."""
    pairs: PairSource = field(init=False)
    _found: tuple[tuple[object, ...], Finding] | None = field(default=None, init=False)
    """Last search (frame, bands, number of spots) and its result, which lasers that are on together share."""

    def __post_init__(self) -> None:
        parts = [capture.part for capture in self.recorder.complete_captures]
        part = max(parts) + (not self.bench.rests) if parts else 0
        self.pairs = PairSource(self.session_dir, self.rig, self.bench, part=part)

    def emit(self, event: ev.Event) -> ev.Record:
        """Journal an event, then pass it to every consumer."""
        return self.recorder.emit(event)

    def ask(self, prompt: Prompt) -> Answer:
        """Answer of the operator, with every laser off; a replay uses the journalled answer.

        Raises:
            AnswerNeededError: there is no operator.
            StoppedError: the operator aborts.
            LaserOffNotConfirmedError: a beam stays on.
        """
        answer = self.recorder.answer(prompt.key, prompt.do) or self.ask_now(prompt)
        self.journal_answer(prompt, answer)
        return answer

    def journal_answer(self, prompt: Prompt, answer: Answer) -> None:
        """Journal an answer; a confirmation that overrules a failed check is marked."""
        overrules = prompt.overrules and answer.action == "done"
        self.emit(ev.Answered(key=prompt.key, question=prompt.do, answer=answer, overrules=overrules))

    def confirm_safety(self) -> None:
        """Have eyewear and beam path confirmed before the first emission, again after each resumption."""
        if not self.pairs.may_emit:
            prompt = safety_prompt(self.rig)
            answer = self.ask_now(prompt)
            self.journal_answer(prompt, answer)
            self.pairs.may_emit = True

    def capture(
        self,
        key: str,
        laser_ids: Sequence[str],
        placement: Placement,
        repeat: int,
        scanlines: Sequence[Scanline],
        scene: str | None = None,
        left_off: Sequence[str] = (),
    ) -> Finding:
        """Take a pair of frames with `laser_ids` on and all lasers off, store it, and find its spots.

        A capture with a scene belongs to a trial, one without a scene to the calibration. Lasers in
        `left_off` stay off as if they had failed.

        Raises:
            StoppedError: a stop was requested.
            LaserOffNotConfirmedError: a beam stays on.
        """
        self.begin(key)
        on, off, taken = self.pairs.pair(key, laser_ids, placement, repeat, scene, left_off)
        self.emit(taken)
        finding = self._find(on, off, taken, laser_ids, scanlines)
        self.emit(spots_found(key, finding, laser_ids))
        self.pairs.check_dark(key, off, finding, scanlines)
        self.captures.append(taken)
        self.findings[key] = finding
        return finding

    def _find(
        self,
        on: Image,
        off: Image,
        taken: ev.CaptureTaken,
        laser_ids: Sequence[str],
        scanlines: Sequence[Scanline],
    ) -> Finding:
        """Spots of a capture; of one laser in a calibration, its own."""
        alone = taken.scene is None and len(laser_ids) == 1
        laser = self.rig.lasers[self.rig.laser_ids.index(laser_ids[0])] if alone else None
        expected = len(laser_ids) if laser is None else sought(self.rig, laser)[1]
        search = taken.on.path, taken.on.sha256, tuple(scanlines), expected
        if self._found is None or self._found[0] != search:
            speckle_sd_px = self._speckle_sd_px(taken.scene)
            found = find_spots(on, off, scanlines=scanlines, expected=expected, speckle_sd_px=speckle_sd_px)
            self._found = search, found
        return self._found[1] if laser is None else own_spots(self.rig, laser, self._found[1])

    def _speckle_sd_px(self, scene: str | None) -> float:
        """Deviation of a centre by speckle, as stated for a capture.

        A trial has that of its calibration, as `workbench range` has; captures of a calibration have that
        of the rig file.
        """
        if scene is not None and self.calibration is not None:
            return self.calibration.laser_ranger.noise.speckle_sd_px
        return self.rig.noise.speckle_sd_px

    def capture_room_light(self, key: str, placement: Placement, repeat: int) -> Image:
        """Take a frame of the board with all lasers off, and store it.

        Raises:
            StoppedError: a stop was requested.
        """
        self.begin(key)
        image, taken = self.pairs.room_light(key, placement, repeat)
        self.emit(taken)
        self.captures.append(taken)
        return image

    def warm_up(self, key: str, frames: int) -> None:
        """Take a number of frames with the lasers off, without storing them.

        Raises:
            StoppedError: a stop was requested.
        """
        self.bench.lasers.all_off()
        for _ in range(frames):
            self.begin(key)
            self.bench.camera.grab()

    def measure_latency(self, key: str, most_frames: int) -> ev.LatencyMeasured:
        """Measure the camera's latency, set it to discard as many frames, and look for automatic control.

        Raises:
            RigNotReadyError: the camera has no readable stream, or no frame of `most_frames` shows the laser.
        """
        camera = self.bench.camera
        if not isinstance(camera, StreamingCamera):
            raise RigNotReadyError(
                "camera: expected a driver with a readable stream; remove the measure_latency step"
            )
        measured = self.recorder.latency
        if measured is None:
            self.confirm_safety()
            self.begin(key)
            frames = count_latency(self.bench.lasers, camera, self.rig, most_frames)
            camera.discard_frames = frames
            found = find_automatic_control(self.bench.lasers, camera, self.rig)
            measured = ev.LatencyMeasured(frames=frames, darkening=found.darkening, dimming=found.dimming)
        camera.discard_frames = measured.frames
        self.emit(measured)
        return measured

    def continue_clock(self) -> None:
        """Set simulated time to the last capture that counts; called before those of each placement."""
        counted = (*self.recorder.complete_captures, *self.captures)
        self.bench.clock.continue_after(max((capture.time_ns for capture in counted), default=0))

    def check_stop(self) -> None:
        """Raise an error if a stop was requested.

        Raises:
            StoppedError: a stop was requested.
        """
        if (reason := self.stopping()) is not None:
            raise StoppedError(reason)

    def begin(self, key: str) -> None:
        """Mark the beginning of a capture on the bench; raises the error of `check_stop`."""
        self.check_stop()
        self.bench.mark(key)

    def ask_now(self, prompt: Prompt) -> Answer:
        """Answer of the operator, asked even in a replay; raises the errors of `ask`."""
        self.bench.lasers.all_off()
        answer = self.operator.ask(prompt)
        self.check_stop()
        if answer.action == "abort":
            raise StoppedError(f"aborted by the operator at {prompt.key}: {answer.reason}")
        return answer

    def forget(self, key: str) -> None:
        """Drop all captures at a placement that is captured again or skipped."""
        self.recorder.forget(key)
        self.boards.pop(key, None)
        self.readings = [reading for reading in self.readings if not reading.scene.startswith(f"{key}/")]
        for capture in [c for c in self.captures if c.placement_key == key]:
            self.captures.remove(capture)
            self.findings.pop(capture.key, None)
