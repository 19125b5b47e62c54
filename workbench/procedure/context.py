"""What a running procedure carries from step to step."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from workbench.calibration.boards import BoardView
from workbench.calibration.observations import Rejected
from workbench.calibration.sightings import prior_scanline
from workbench.calibration.validation import LeftOut
from workbench.devices.protocols import Bench, Operator, StreamingCamera
from workbench.model import event as ev
from workbench.model.calibration import Calibration, Provenance
from workbench.model.captures import ALL_LASERS, BOARD
from workbench.model.errors import BadInputError, LaserOffNotConfirmedError, RigNotReadyError, StoppedError
from workbench.model.prompt import Answer, Prompt
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.procedure.exposure import restore_exposure, set_exposure
from workbench.procedure.latency import LEASE_S, count_latency
from workbench.procedure.prompts import placement_prompt, safety_prompt
from workbench.procedure.recorder import SAFETY, Recorder
from workbench.session.frames import FrameStore, read_image
from workbench.session.state import Group
from workbench.spots import Finding, Image, Scanline, find_spots

T = TypeVar("T")


class RetakeError(Exception):
    """What was captured at the present placement is to be captured again; says why."""


class _LeftOutError(Exception):
    """The present placement is to be left out."""

    def __init__(self, answer: Answer) -> None:
        super().__init__()
        self.answer = answer


@dataclass(frozen=True)
class Ahead:
    """The fit to come in this procedure."""

    planned_mm: tuple[float, ...]
    """Standoffs of all capture_grid steps before it."""
    limit: float
    """On the relative sd of ranges."""


@dataclass
class Context:
    """The bench, the session and the results so far."""

    session_dir: Path
    rig: Rig
    bench: Bench
    operator: Operator
    recorder: Recorder
    provenance: Provenance
    stopping: Callable[[], str | None]
    """Asked between shots; a text ends the session with it."""
    captures: list[ev.CaptureTaken] = field(default_factory=list)
    findings: dict[str, Finding] = field(default_factory=dict)
    """By the capture's key."""
    boards: dict[str, BoardView | Rejected] = field(default_factory=dict)
    """By the placement's key."""
    ahead: Ahead | None = None
    """What the captures of the present step are for; None where no fit follows in its procedure."""
    accepted: Calibration | None = None
    """What the last fit amounts to."""
    left_out: tuple[LeftOut, ...] = ()
    """And what it says of each placement when it has not seen it."""
    calibration: Calibration | None = None
    """The exported one: what a trial ranges with."""
    _served: Group | None = None
    """What is on disk already of the present placement."""
    _exposure: float | None = None
    """Of the present placement, where the camera's is set."""
    _dark: Image | None = None
    """The last frame at the present placement with all lasers off."""
    _safe: bool = False
    """Whether somebody has confirmed that the beams may be switched on."""

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
        answer = self.recorder.answer(prompt.key) or self._ask_now(prompt)
        self.emit(ev.Answered(key=prompt.key, question=prompt.do, answer=answer))
        return answer

    def confirm_safety(self) -> None:
        """Before the first emission: eyewear and beam path, whoever resumes a session asks again."""
        if not self._safe:
            prompt = safety_prompt(self.rig)
            answer = self._ask_now(prompt)
            self.emit(ev.Answered(key=SAFETY, question=prompt.do, answer=answer))
            self._safe = True

    def visit(self, placements: Sequence[Placement], work: Callable[[Placement], T]) -> list[T]:
        """Have the target placed at one placement after the other, and do the `work` at each.

        The operator may skip one, or have the one before captured again. What is done at a placement is a
        group: a resumed session serves whole ones from disk, and repeats the one that was under way.

        Args:
            placements: where the target is to stand; their keys differ.
            work: gets the placement as measured; takes every capture under its key.

        Returns:
            What `work` returned, for the placements that were not skipped.

        Raises:
            AnswerNeededError, StoppedError, LaserOffNotConfirmedError: see `ask`.
        """
        results: dict[str, T] = {}
        began: dict[str, int] = {}
        index = 0
        while index < len(placements):
            asked = placements[index]
            before = placements[index - 1].key if index and placements[index - 1].key in began else None
            self._served = self.recorder.group(asked.key)
            answer = self._place_answer(asked, before)
            if answer.action == "redo" and before is not None:
                self._set_aside(before, began.pop(before), answer.reason or "")
                results.pop(before, None)
                index -= 1
                continue
            index += 1
            if answer.action == "skip":
                self._tell_skipped(asked, answer)
                continue
            record, placed = self._place(asked, answer)
            began[asked.key] = record.n
            try:
                results[asked.key] = self._work(work, placed, record.n, answer)
            except _LeftOutError as left_out:
                del began[asked.key]
                self._tell_skipped(asked, left_out.answer)
            else:
                self._look_for_stuck_beam(asked.key)
                self.emit(ev.PlacementFinished(key=asked.key))
            self._served = None
        return list(results.values())

    def _work(self, work: Callable[[Placement], T], placed: Placement, from_n: int, answer: Answer) -> T:
        """Do the work at a placement, again where it asks for that."""
        while True:
            try:
                self._set_exposure(placed.key)
                return work(placed)
            except RetakeError as again:
                self._set_aside(placed.key, from_n, str(again))
                self._served = None
                FrameStore(self.session_dir).set_aside(placed.key)
                from_n = self.emit(ev.TargetPlaced(placement=placed, by=answer.by)).n
            except _LeftOutError as left_out:
                self._set_aside(placed.key, from_n, left_out.answer.reason or "")
                raise

    def _set_exposure(self, key: str) -> None:
        """Set it by trial shots; of what is on disk already it is known.

        Raises:
            StoppedError: a stop was asked for.
            LaserOffNotConfirmedError: a beam stays on.
            RigNotReadyError: a device does not answer.
        """
        if self._served is None:
            found = set_exposure(self.bench, self.rig, key, self._begin)
        elif (found := self._served.exposure) is not None:
            restore_exposure(self.bench, found)
        self._exposure = None if found is None else found.exposure
        if found is not None:
            self.emit(found)

    def _tell_skipped(self, asked: Placement, answer: Answer) -> None:
        self.emit(ev.Answered(key=asked.key, question=f"{asked.standoff_mm:g} mm", answer=answer))

    def settle(self, prompt: Prompt, failed: str) -> None:
        """Ask what to do about a limit that failed at the present placement; returns where it is kept.

        Raises:
            RetakeError: it is to be captured again.
            AnswerNeededError, StoppedError, LaserOffNotConfirmedError: see `ask`.
        """
        answer = self.recorder.answer(prompt.key) or self._ask_now(prompt)
        if answer.action == "redo":
            raise RetakeError(f"{failed}: {answer.reason}")
        if answer.action == "skip":
            raise _LeftOutError(answer)
        self.emit(ev.Answered(key=prompt.key, question=prompt.do, answer=answer))

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
        self._begin(key)
        on, off, taken = self._kept_pair(key) or self._shoot(key, laser_ids, placement, repeat, scene)
        self.emit(taken)
        finding = find_spots(on, off, scanlines=scanlines, expected=len(laser_ids))
        self.emit(_spots_found(key, finding, laser_ids))
        if not finding.spots:
            self._check_dark(key, off, scanlines)
        self._dark = off
        self.captures.append(taken)
        self.findings[key] = finding
        return finding

    def capture_room_light(self, key: str, placement: Placement, repeat: int) -> Image:
        """Take a frame of the board with no laser lit, and store it.

        Raises:
            StoppedError: a stop was asked for.
        """
        self._begin(key)
        kept = self._kept(key)
        image, taken = (self._read(kept.on), kept) if kept else self._expose(key, placement, repeat)
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
            self._begin(key)
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
            self._begin(key)
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

    def _begin(self, key: str) -> None:
        self.check_stop()
        self.bench.mark(key)

    def _ask_now(self, prompt: Prompt) -> Answer:
        self.bench.lasers.all_off()
        answer = self.operator.ask(prompt)
        self.check_stop()
        if answer.action == "abort":
            raise StoppedError(f"aborted by the operator at {prompt.key}: {answer.reason}")
        return answer

    def _place_answer(self, asked: Placement, before: str | None) -> Answer:
        if self._served is not None:
            return Answer()
        known = self.recorder.answer(asked.key)
        if known is not None and known.action == "skip":
            return known
        self.confirm_safety()
        return self._ask_now(placement_prompt(asked, can_redo=before is not None))

    def _place(self, asked: Placement, answer: Answer) -> tuple[ev.Record, Placement]:
        """The target stands; what stood in frames of an earlier try is moved aside."""
        if self._served is not None:
            return self.emit(self._served.placed), self._served.placed.placement
        FrameStore(self.session_dir).set_aside(asked.key)
        measured = answer.value if isinstance(answer.value, float) else asked.standoff_mm
        placed = self.bench.target.place(asked.model_copy(update={"standoff_mm": measured}))
        return self.emit(ev.TargetPlaced(placement=placed, by=answer.by)), placed

    def _set_aside(self, key: str, from_n: int, reason: str) -> None:
        """Forget what was captured at a placement; its frames are kept, moved aside when it is repeated."""
        self.emit(ev.SetAside(key=key, from_n=from_n, reason=reason))
        self.recorder.forget(key)
        self.boards.pop(key, None)
        for capture in [c for c in self.captures if c.placement_key == key]:
            self.captures.remove(capture)
            self.findings.pop(capture.key, None)

    def _shoot(
        self, key: str, laser_ids: Sequence[str], placement: Placement, repeat: int, scene: str | None
    ) -> tuple[Image, Image, ev.CaptureTaken]:
        began = time.monotonic()
        with self.bench.lasers.lit(laser_ids, for_s=LEASE_S):
            on = self.bench.camera.grab()
        lit_s = time.monotonic() - began
        off = self.bench.camera.grab()
        frames = FrameStore(self.session_dir)
        taken = ev.CaptureTaken(
            key=key,
            purpose="calibration" if scene is None else "trial",
            scene=scene,
            laser_id=laser_ids[0] if len(laser_ids) == 1 else ALL_LASERS,
            placement_key=placement.key,
            standoff_mm=placement.standoff_mm,
            standoff_sd_mm=placement.standoff_sd_mm,
            repeat=repeat,
            on=frames.save(key, "on", on.image, on.time_ns),
            off=frames.save(key, "off", off.image, off.time_ns),
            exposure=self._exposure,
            lit_s=lit_s,
        )
        return on.image, off.image, taken

    def _expose(self, key: str, placement: Placement, repeat: int) -> tuple[Image, ev.CaptureTaken]:
        frame = self.bench.camera.grab_ambient()
        taken = ev.CaptureTaken(
            key=key,
            purpose="calibration",
            laser_id=BOARD,
            placement_key=placement.key,
            standoff_mm=placement.standoff_mm,
            standoff_sd_mm=placement.standoff_sd_mm,
            repeat=repeat,
            on=FrameStore(self.session_dir).save(key, "on", frame.image, frame.time_ns),
        )
        return frame.image, taken

    def _kept(self, key: str) -> ev.CaptureTaken | None:
        """The capture as taken before the session ended early.

        Raises:
            BadInputError: the placement is whole, but not with this capture.
        """
        if self._served is None:
            return None
        if key not in self._served.captures:
            raise BadInputError(
                f"capture {key}: expected it among those of its placement, which was finished without it; a"
                " change of rig or procedure asks for captures that were never taken: run the procedure anew"
            )
        return self._served.captures[key]

    def _kept_pair(self, key: str) -> tuple[Image, Image, ev.CaptureTaken] | None:
        taken = self._kept(key)
        if taken is None or taken.off is None:
            return None
        return self._read(taken.on), self._read(taken.off), taken

    def _read(self, frame: ev.FrameRef) -> Image:
        path = self.session_dir / frame.path
        image = read_image(path)
        if hashlib.sha256(path.read_bytes()).hexdigest() != frame.sha256:
            raise BadInputError(
                f"{path}: the frame has changed since it was captured; restore it from a copy"
            )
        return image

    def _look_for_stuck_beam(self, key: str) -> None:
        """Look for any beam in the last dark frame of a group: another laser's pairs do not show it.

        Raises:
            LaserOffNotConfirmedError: see `_check_dark`.
        """
        dark, self._dark = self._dark, None
        if dark is not None:
            self._check_dark(key, dark, [prior_scanline(self.rig, laser) for laser in self.rig.lasers])

    def _check_dark(self, key: str, off: Image, scanlines: Sequence[Scanline]) -> None:
        """Look for a beam that burns in both frames of a pair: it leaves no spot in their difference.

        Raises:
            LaserOffNotConfirmedError: there is a spot in it.
        """
        if stuck := find_spots(off, scanlines=scanlines).spots:
            at = f"u = {stuck[0].u_px:.0f}, v = {stuck[0].v_px:.0f} px"
            raise LaserOffNotConfirmedError(
                f"capture {key}: the frame with all lasers off shows a spot at {at}. A beam may be on"
                " although the controller says that it is off: cut the lasers' supply, keep out of the"
                " beams, then check the controller. If a lamp or its reflection stands there, cover it"
                " and start anew"
            )


def _spots_found(key: str, finding: Finding, laser_ids: Sequence[str]) -> ev.SpotsFound:
    only = laser_ids[0] if len(laser_ids) == 1 and len(finding.spots) == 1 else None
    return ev.SpotsFound(
        key=key,
        spots=tuple(
            ev.SpotRecord(
                laser_id=only,
                u_px=spot.u_px,
                v_px=spot.v_px,
                u_sd_px=spot.u_sd_px,
                v_sd_px=spot.v_sd_px,
                flux_dn=spot.flux_dn,
                width_px=spot.width_px,
                peak_dn=spot.peak_dn,
                flags=tuple(sorted(spot.flags)),
            )
            for spot in finding.spots
        ),
        failures=tuple(finding.failures),
    )
