"""One capture: taken and stored, or served from disk; and a look for beams that burn when they should not."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from workbench.calibration.data.spot_rows import prior_scanline
from workbench.devices.protocols import Bench
from workbench.model import event as ev
from workbench.model.arrays import Image
from workbench.model.captures import ALL_LASERS, BOARD
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.procedure.capture.exposure import set_exposure
from workbench.procedure.capture.latency import LEASE_S
from workbench.session.frames import FrameStore, read_image
from workbench.session.state import Group
from workbench.spots import Finding, Scanline, Spot, find_spots, refuse_stuck_beam

LATENCY_ADVICE = "begin the procedure with a measure_latency step"


@dataclass
class PairSource:
    """The captures at one placement after the other."""

    session_dir: Path
    rig: Rig
    bench: Bench
    served: Group | None = None
    """What is on disk already of the present placement."""
    may_fire: bool = False
    """Whether somebody has confirmed that the beams may be switched on."""
    _exposure: ev.ExposureSet | None = None
    """Of the present placement, where the camera's is set."""
    _dark: Image | None = None
    """The last frame at the present placement with all lasers off."""

    def set_exposure(self, key: str, begin: Callable[[str], None]) -> ev.ExposureSet | None:
        """Set it for a placement by trial shots; of what is on disk already it is known.

        Args:
            key: the placement's.
            begin: called with the key of each trial before it.

        Returns:
            What was set; None where the camera's exposure is not to be set.

        Raises:
            LaserOffNotConfirmedError: a beam stays on.
            RigNotReadyError: a device does not answer.
        """
        if self.served is None:
            self._refuse_unsafe()
            found = set_exposure(self.bench, self.rig, key, begin)
        else:  # nothing is captured there any more: the camera is left as it is
            found = self.served.exposure
        self._exposure = found
        return found

    def pair(
        self, key: str, laser_ids: Sequence[str], placement: Placement, repeat: int, scene: str | None
    ) -> tuple[Image, Image, ev.CaptureTaken]:
        """Frames with `laser_ids` lit and all off.

        Raises:
            BadInputError: the placement is whole, but not with this capture, or a frame has changed.
            LaserOffNotConfirmedError: a beam stays on.
            RigNotReadyError: a device does not answer.
        """
        kept = self._kept(key)
        if kept is None or kept.off is None:
            return self._shoot(key, laser_ids, placement, repeat, scene)
        return self._read(kept.on), self._read(kept.off), kept

    def room_light(self, key: str, placement: Placement, repeat: int) -> tuple[Image, ev.CaptureTaken]:
        """A frame with no laser lit; the errors of `pair`."""
        kept = self._kept(key)
        return (self._read(kept.on), kept) if kept else self._expose(key, placement, repeat)

    def look_at_dark(self, key: str, off: Image, finding: Finding, scanlines: Sequence[Scanline]) -> None:
        """Keep the dark frame of a capture; where its pair shows no spot, look for one in it.

        What is on disk already was looked at when it was taken.

        Raises:
            LaserOffNotConfirmedError: there is a spot in it.
        """
        if self.served is not None:
            return
        if not finding.spots:
            self._search(key, off, scanlines)
        self._dark = off

    def look_for_stuck_beam(self, key: str) -> None:
        """Look for any beam in the last dark frame of a group: another laser's pairs do not show it.

        Raises:
            LaserOffNotConfirmedError: see `look_at_dark`.
        """
        dark, self._dark = self._dark, None
        if dark is not None:
            self._search(key, dark, [prior_scanline(self.rig, laser) for laser in self.rig.lasers])

    def _shoot(
        self, key: str, laser_ids: Sequence[str], placement: Placement, repeat: int, scene: str | None
    ) -> tuple[Image, Image, ev.CaptureTaken]:
        self._refuse_unsafe()
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
            exposure=None if self._exposure is None else self._exposure.exposure,
            exposure_unit=None if self._exposure is None else self._exposure.unit or None,
            lit_s=lit_s,
        )
        return on.image, off.image, taken

    def _refuse_unsafe(self) -> None:
        if not self.may_fire:
            raise RuntimeError("a laser was to be lit before anybody confirmed eyewear and beam path")

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
        if self.served is None:
            return None
        if key not in self.served.captures:
            raise BadInputError(
                f"capture {key}: expected it among those of its placement, which was finished without it; a"
                " change of rig or procedure asks for captures that were never taken: run the procedure anew"
            )
        return self.served.captures[key]

    def _read(self, frame: ev.FrameRef) -> Image:
        path = self.session_dir / frame.path
        image = read_image(path)
        if hashlib.sha256(path.read_bytes()).hexdigest() != frame.sha256:
            raise BadInputError(
                f"{path}: the frame has changed since it was captured; restore it from a copy"
            )
        return image

    def _search(self, key: str, off: Image, scanlines: Sequence[Scanline]) -> None:
        """Check a dark frame; the errors of `refuse_stuck_beam`."""

        def look_again() -> Sequence[Spot]:
            return find_spots(self.bench.camera.grab().image, scanlines=scanlines).spots

        lights = find_spots(off, scanlines=scanlines).spots
        refuse_stuck_beam(f"capture {key}", lights, look_again, LATENCY_ADVICE)


def spots_found(key: str, finding: Finding, laser_ids: Sequence[str]) -> ev.SpotsFound:
    """The record of what was found in a capture; of a laser alone, its one spot is the laser's."""
    spots = finding.spots
    if len(laser_ids) == 1 and len(spots) == 1:
        spots = (replace(spots[0], laser_id=laser_ids[0]),)
    return ev.SpotsFound(key=key, spots=spots, failures=tuple(finding.failures))
