"""Captures: taken and stored, or replayed from disk; with a check for stuck beams."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path

from workbench.calibration.data.spot_rows import prior_scanlines
from workbench.devices.attempts import within_lease
from workbench.devices.protocols import Bench, Frame, settable
from workbench.model import event as ev
from workbench.model.arrays import Image
from workbench.model.captures import ALL_LASERS, BOARD
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.procedure.capture.exposure import set_exposure
from workbench.procedure.capture.latency import LEASE_S
from workbench.session.frames import FrameStore, read_image
from workbench.session.state import PlacementCaptures
from workbench.spots import Finding, Scanline, Spot, find_spots, refuse_stuck_beam

LATENCY_ADVICE = "begin the procedure with a measure_latency step"


@dataclass
class PairSource:
    """Source of captures at the present placement: the bench, or the frames on disk in a replay."""

    session_dir: Path
    rig: Rig
    bench: Bench
    replayed: PlacementCaptures | None = None
    """Captures on disk, if the present placement is replayed."""
    part: int = 0
    """Part of the session that new captures belong to."""
    may_emit: bool = False
    """Whether the operator has confirmed that the lasers may be switched on."""
    _exposure: ev.ExposureSet | None = None
    """Exposure of the present placement, if it was set."""
    _dark: Image | None = None
    """Last frame at the present placement with all lasers off."""
    _last: tuple[Image, Image, ev.CaptureTaken] | None = None
    """Last pair from the bench."""
    _taken_for: set[str] = field(default_factory=set)
    """Lasers whose capture it is: several where they are on together."""

    def set_exposure(self, placed: Placement, begin: Callable[[str], None]) -> ev.ExposureSet | None:
        """Set the exposure for a placement by trial exposures; a replay takes it from the journal.

        Args:
            placed: the placement.
            begin: called before each trial exposure with its key.

        Returns:
            The exposure that was set; None if the camera's exposure cannot or must not be set.

        Raises:
            LaserOffNotConfirmedError: a beam stays on.
            RigNotReadyError: a device does not answer.
        """
        if self.replayed is None:
            self._refuse_unsafe()
            found = set_exposure(self.bench, self.rig, placed.key, begin, placed.head_deg or 0.0)
        else:  # no further captures at this placement: the camera is left unchanged
            found = self.replayed.exposure
        self._exposure = found
        return found

    def change_exposure(self, exposure: float) -> None:
        """Set the exposure of the next captures at the placement; a replay leaves the camera unchanged.

        Nothing changes where the exposure was not set for the placement.

        Raises:
            RigNotReadyError: the camera does not accept the exposure.
        """
        found = settable(self.bench.camera)
        if self.replayed is not None or self._exposure is None or found is None:
            return
        camera, (shortest, longest) = found
        accepted = camera.set_exposure(min(max(exposure, shortest), longest))
        self._exposure = self._exposure.model_copy(update={"exposure": accepted})

    def pair(
        self,
        key: str,
        laser_ids: Sequence[str],
        placement: Placement,
        repeat: int,
        scene: str | None,
        left_off: Sequence[str] = (),
    ) -> tuple[Image, Image, ev.CaptureTaken]:
        """Pair of frames: `laser_ids` without those of `left_off` on, and all lasers off.

        Raises:
            BadInputError: a replayed placement lacks this capture, or a frame on disk has changed.
            LaserOffNotConfirmedError: a beam stays on.
            RigNotReadyError: a device does not answer.
        """
        kept = self._kept(key)
        if kept is None or kept.off is None:
            return self._capture(key, laser_ids, placement, repeat, scene, left_off)
        return self._read(kept.on), self._read(kept.off), kept

    def room_light(self, key: str, placement: Placement, repeat: int) -> tuple[Image, ev.CaptureTaken]:
        """Frame with all lasers off; raises the errors of `pair`."""
        kept = self._kept(key)
        return (self._read(kept.on), kept) if kept else self._capture_room_light(key, placement, repeat)

    def check_dark(self, key: str, off: Image, finding: Finding, scanlines: Sequence[Scanline]) -> None:
        """Keep the dark frame of a capture; if the pair shows no spot, search the dark frame for one.

        Replayed frames were checked when they were taken.

        Raises:
            LaserOffNotConfirmedError: the dark frame shows a spot.
        """
        if self.replayed is not None:
            return
        if not finding.spots:
            self._search(key, off, scanlines)
        self._dark = off

    def check_stuck_beam(self, key: str) -> None:
        """Search the last dark frame of a placement for any beam; pairs show only beams of their own laser.

        Raises:
            LaserOffNotConfirmedError: the dark frame shows a spot.
        """
        dark, self._dark = self._dark, None
        if dark is not None:
            head_deg = None if self._last is None else self._last[2].head_deg
            self._search(key, dark, prior_scanlines(self.rig, head_deg or 0.0))

    def _capture(
        self,
        key: str,
        laser_ids: Sequence[str],
        placement: Placement,
        repeat: int,
        scene: str | None,
        left_off: Sequence[str],
    ) -> tuple[Image, Image, ev.CaptureTaken]:
        self._refuse_unsafe()
        if scene is None and (shared := self._shared_pair(laser_ids, placement, repeat)) is not None:
            on_image, off_image, taken = shared
            return on_image, off_image, taken.model_copy(update={"key": key, "laser_id": laser_ids[0]})
        asked = set(laser_ids).difference(left_off)
        groups = [[laser.id for laser in group] for group in self.rig.emitters]
        lit = [laser_id for group in groups if asked.intersection(group) for laser_id in group]
        on, clock_ns, lit_s = within_lease(lambda: self._grab_lit(key, lit))
        frames = FrameStore(self.session_dir)
        with ThreadPoolExecutor(1) as beside:  # the lit frame is stored while the dark one is exposed
            storing = beside.submit(frames.save, key, "on", on.image, on.time_ns)
            off = self.bench.camera.grab()
            off_stored = frames.save(key, "off", off.image, off.time_ns)
            on_stored = storing.result()
        taken = ev.CaptureTaken(
            key=key,
            purpose="calibration" if scene is None else "trial",
            scene=scene,
            laser_id=laser_ids[0] if len(laser_ids) == 1 else ALL_LASERS,
            left_off=tuple(left_off),
            placement_key=placement.key,
            standoff_mm=placement.standoff_mm,
            standoff_sd_mm=placement.standoff_sd_mm,
            repeat=repeat,
            on=on_stored,
            off=off_stored,
            exposure=None if self._exposure is None else self._exposure.exposure,
            exposure_unit=None if self._exposure is None else self._exposure.unit or None,
            lit_s=lit_s,
            clock_ns=clock_ns,
            part=self.part,
            head_deg=placement.head_deg,
        )
        self._last = on.image, off.image, taken
        self._taken_for = {taken.laser_id}
        return on.image, off.image, taken

    def _shared_pair(
        self, laser_ids: Sequence[str], placement: Placement, repeat: int
    ) -> tuple[Image, Image, ev.CaptureTaken] | None:
        """Last capture, if it shows a laser that was on with those of the same emitter; each laser once."""
        if self._last is None or len(laser_ids) != 1 or laser_ids[0] in self._taken_for:
            return None
        last, (laser_id,) = self._last[2], laser_ids
        together = next(
            {laser.id for laser in group}
            for group in self.rig.emitters
            if laser_id in {laser.id for laser in group}
        )
        if last.laser_id not in together or (last.placement_key, last.repeat) != (placement.key, repeat):
            return None
        self._taken_for.add(laser_id)
        return self._last

    def _grab_lit(self, key: str, laser_ids: Sequence[str]) -> tuple[Frame, int, float]:
        """Frame with lasers on, the bench's time, and how long they were on, s."""
        self.bench.mark(key)  # here, as a virtual frame that is taken again must be the same
        began = time.monotonic()
        with self.bench.lasers.lit(laser_ids, for_s=LEASE_S):
            on = self.bench.camera.grab()
            clock_ns = self.bench.clock.now_ns()
        return on, clock_ns, time.monotonic() - began

    def _refuse_unsafe(self) -> None:
        if not self.may_emit:
            raise RuntimeError("a laser must not be switched on before eyewear and beam path are confirmed")

    def _capture_room_light(
        self, key: str, placement: Placement, repeat: int
    ) -> tuple[Image, ev.CaptureTaken]:
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
            clock_ns=self.bench.clock.now_ns(),
            part=self.part,
        )
        return frame.image, taken

    def _kept(self, key: str) -> ev.CaptureTaken | None:
        """Capture on disk, if the placement is replayed.

        Raises:
            BadInputError: the replayed placement lacks this capture.
        """
        if self.replayed is None:
            return None
        if key not in self.replayed.captures:
            raise BadInputError(
                f"capture {key}: not among the captures of its complete placement; the rig or the procedure"
                " has changed and requires further captures: run the procedure again in a new session"
            )
        return self.replayed.captures[key]

    def _read(self, frame: ev.FrameRef) -> Image:
        path = self.session_dir / frame.path
        image = read_image(path)
        if hashlib.sha256(path.read_bytes()).hexdigest() != frame.sha256:
            raise BadInputError(
                f"{path}: the frame has changed since it was captured; restore it from a copy"
            )
        return image

    def _search(self, key: str, off: Image, scanlines: Sequence[Scanline]) -> None:
        """Check a dark frame; raises the errors of `refuse_stuck_beam`."""

        def look_again() -> Sequence[Spot]:
            return find_spots(self.bench.camera.grab().image, scanlines=scanlines).spots

        lights = find_spots(off, scanlines=scanlines).spots
        refuse_stuck_beam(f"capture {key}", lights, look_again, LATENCY_ADVICE)


def spots_found(key: str, finding: Finding, laser_ids: Sequence[str]) -> ev.SpotsFound:
    """Event of the spots in a capture; a single spot in a capture of one laser is assigned to it."""
    spots = finding.spots
    if len(laser_ids) == 1 and len(spots) == 1:
        spots = (replace(spots[0], laser_id=laser_ids[0]),)
    return ev.SpotsFound(key=key, spots=spots, failures=tuple(finding.failures))
