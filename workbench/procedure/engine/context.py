"""What a running procedure carries from step to step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from workbench.devices.protocols import Bench, Operator, StreamingCamera
from workbench.model import event as ev
from workbench.model.arrays import Image
from workbench.model.calibration import Calibration, Provenance
from workbench.model.errors import RigNotReadyError, StoppedError
from workbench.model.prompt import Answer, Prompt
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.procedure.capture.latency import count_latency
from workbench.procedure.capture.pair import PairSource, spots_found
from workbench.procedure.engine.prompts import SAFETY, safety_prompt
from workbench.procedure.engine.replay import ReplayingJournal
from workbench.procedure.engine.step import Step
from workbench.spots import Finding, Scanline, find_spots

if TYPE_CHECKING:  # results of steps: a file is checked without the solver
    from workbench.calibration.data.boards import BoardView
    from workbench.model.fit_event import CrossValidatedPlacement, Rejected


@dataclass
class Context:
    """The bench, the session and the results so far."""

    session_dir: Path
    rig: Rig
    bench: Bench
    operator: Operator
    recorder: ReplayingJournal
    provenance: Provenance
    stopping: Callable[[], str | None]
    """Asked between shots; a text ends the session with it."""
    captures: list[ev.CaptureTaken] = field(default_factory=list)
    findings: dict[str, Finding] = field(default_factory=dict)
    """By the capture's key."""
    boards: dict[str, BoardView | Rejected] = field(default_factory=dict)
    """By the placement's key."""
    steps: Sequence[Step] = ()
    """All of the procedure under way."""
    step_index: int = 0
    """Of the step under way among `steps`, from 0."""
    accepted: Calibration | None = None
    """What the last fit amounts to."""
    left_out: tuple[CrossValidatedPlacement, ...] = ()
    """Its cross-validation."""
    calibration: Calibration | None = None
    """The exported one: trials range with it."""
    pairs: PairSource = field(init=False)

    def __post_init__(self) -> None:
        self.pairs = PairSource(self.session_dir, self.rig, self.bench)

    def emit(self, event: ev.Event) -> ev.Record:
        """Journal an event, then show it to every consumer."""
        return self.recorder.emit(event)

    def ask(self, prompt: Prompt) -> Answer:
        """The operator's answer, with every laser off; a resumed session asks only what is open still.

        Raises:
            AnswerNeededError: nobody is there to answer.
            StoppedError: the operator aborts.
            LaserOffNotConfirmedError: a beam stays on.
        """
        answer = self.recorder.answer(prompt.key) or self.ask_now(prompt)
        self.emit(ev.Answered(key=prompt.key, question=prompt.do, answer=answer))
        return answer

    def confirm_safety(self) -> None:
        """Before the first emission: eyewear and beam path, whoever resumes a session asks again."""
        if not self.pairs.may_fire:
            prompt = safety_prompt(self.rig)
            answer = self.ask_now(prompt)
            self.emit(ev.Answered(key=SAFETY, question=prompt.do, answer=answer))
            self.pairs.may_fire = True

    def capture(
        self,
        key: str,
        laser_ids: Sequence[str],
        placement: Placement,
        repeat: int,
        scanlines: Sequence[Scanline],
        scene: str | None = None,
    ) -> Finding:
        """Take a pair of frames with `laser_ids` lit and all off, store it, and find the spots in it.

        A capture with a scene belongs to a trial, one without to the calibration.

        Raises:
            StoppedError: a stop was asked for.
            LaserOffNotConfirmedError: a beam stays on.
        """
        self.begin(key)
        on, off, taken = self.pairs.pair(key, laser_ids, placement, repeat, scene)
        self.emit(taken)
        finding = find_spots(on, off, scanlines=scanlines, expected=len(laser_ids))
        self.emit(spots_found(key, finding, laser_ids))
        self.pairs.look_at_dark(key, off, finding, scanlines)
        self.captures.append(taken)
        self.findings[key] = finding
        return finding

    def capture_room_light(self, key: str, placement: Placement, repeat: int) -> Image:
        """Take a frame of the board with no laser lit, and store it.

        Raises:
            StoppedError: a stop was asked for.
        """
        self.begin(key)
        image, taken = self.pairs.room_light(key, placement, repeat)
        self.emit(taken)
        self.captures.append(taken)
        return image

    def warm_up(self, key: str, frames: int) -> None:
        """Have the camera take so many frames, with the lasers off.

        Raises:
            StoppedError: a stop was asked for.
        """
        self.bench.lasers.all_off()
        for _ in range(frames):
            self.begin(key)
            self.bench.camera.grab()

    def measure_latency(self, key: str, most_frames: int) -> int:
        """Count the frames from a laser's switching on to the first that shows it, and have them discarded.

        Raises:
            RigNotReadyError: the camera cannot tell, or none of `most_frames` shows the laser.
        """
        camera = self.bench.camera
        if not isinstance(camera, StreamingCamera):
            raise RigNotReadyError("camera: expected one whose stream can be read frame by frame")
        frames = self.recorder.latency
        if frames is None:
            self.confirm_safety()
            self.begin(key)
            frames = count_latency(self.bench.lasers, camera, self.rig, most_frames)
        camera.discard_frames = frames
        self.emit(ev.LatencyMeasured(frames=frames))
        return frames

    def check_stop(self) -> None:
        """End here if a stop was asked for.

        Raises:
            StoppedError: it was.
        """
        if (reason := self.stopping()) is not None:
            raise StoppedError(reason)

    def begin(self, key: str) -> None:
        """Name the capture about to be taken, unless a stop was asked for; the error of `check_stop`."""
        self.check_stop()
        self.bench.mark(key)

    def ask_now(self, prompt: Prompt) -> Answer:
        """The operator's answer, whatever was answered before; the errors of `ask`."""
        self.bench.lasers.all_off()
        answer = self.operator.ask(prompt)
        self.check_stop()
        if answer.action == "abort":
            raise StoppedError(f"aborted by the operator at {prompt.key}: {answer.reason}")
        return answer

    def forget(self, key: str) -> None:
        """Drop what was captured at a placement: it is captured again, or left out."""
        self.recorder.forget(key)
        self.boards.pop(key, None)
        for capture in [c for c in self.captures if c.placement_key == key]:
            self.captures.remove(capture)
            self.findings.pop(capture.key, None)
