"""Map of spots that will be lost at a placement, from a calibration or from the design of a rig."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import radians, tan

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.model.calibration import Calibration
from workbench.model.lens import LensName
from workbench.model.rig import Rig
from workbench.model.target import CylinderTarget, FlatTarget, Placement
from workbench.optics.image import in_picture
from workbench.optics.lens import LensModel
from workbench.optics.lens_models import lens_model
from workbench.optics.rays import RAY
from workbench.trials.targets import STEEPEST_ON_CYLINDER

MERGING_PX = 6.0
"""Distance of two spots below which they may be found as one: four widths of a spot."""
STEPS = 20
"""Steps of the iteration for the crossing of a beam and a cylinder; beams are nearly parallel to the axis."""


@dataclass(frozen=True)
class SpotMap:
    """Positions of the spots of n lasers on a target, and why they will be lost."""

    ids: tuple[str, ...]
    model: LensModel
    lens: FloatArray
    """Parameters of the lens, in the model's order."""
    rays: FloatArray
    """(n, 4) x, y in mm, and slopes of the lasers."""
    offset_mm: float
    size_px: tuple[int, int]
    reach_mm: tuple[float, float]
    """Nearest and farthest standoff with spots that are neither saturated nor too dim."""

    @classmethod
    def of_calibration(cls, calibration: Calibration, rig: Rig) -> SpotMap:
        """Map of a calibrated sensor."""
        size = calibration.image_width, calibration.image_height
        ids = tuple(laser.id for laser in calibration.laser_ranger.lasers)
        return cls._of(calibration.distortion_model, calibration.geometry(), ids, size, rig)

    @classmethod
    def of_rig(cls, rig: Rig) -> SpotMap:
        """Map of a sensor as designed; tolerances move its spots."""
        values = {name: prior.value for name, prior in rig.camera.lens_priors.items()}
        values["offset_mm"] = rig.bench.offset_mm.value
        for laser in rig.lasers:
            values |= {f"{laser.id}.{name}": getattr(laser, name).value for name in RAY}
        size = rig.camera.width_px, rig.camera.height_px
        return cls._of(rig.camera.lens, values, rig.laser_ids, size, rig)

    @classmethod
    def _of(
        cls,
        lens: LensName,
        values: Mapping[str, float],
        ids: tuple[str, ...],
        size: tuple[int, int],
        rig: Rig,
    ) -> SpotMap:
        model = lens_model(lens)
        return cls(
            ids,
            model,
            np.array([values.get(name, 0.0) for name in model.parameters]),
            np.array([[values[f"{i}.{name}"] for name in RAY] for i in ids]),
            values["offset_mm"],
            size,
            rig.bench.reach_mm,
        )

    def lost(self, placement: Placement) -> dict[str, str]:
        """Cause of each spot that will be lost, by laser."""
        ranges, causes = self._ranges_mm(placement)
        seen = [n for n, i in enumerate(self.ids) if i not in causes]
        px = self._spots_px(ranges)
        for n in seen:
            if not self._is_in_image(n, float(ranges[n]), px[n]):
                causes[self.ids[n]] = "outside the image"
            elif ranges[n] > self.reach_mm[1]:
                causes[self.ids[n]] = "too dim: beyond the rig's reach"
            elif ranges[n] < self.reach_mm[0]:
                causes[self.ids[n]] = "saturated: nearer than the rig's reach"
        return {i: causes[i] for i in self.ids if i in causes}

    def merged(self, placement: Placement) -> list[tuple[str, str]]:
        """Pairs of lasers whose spots may be found as one; they are captured alone, which takes longer."""
        ranges, _ = self._ranges_mm(placement)
        px, lost = self._spots_px(ranges), self.lost(placement)
        kept = [n for n, i in enumerate(self.ids) if i not in lost]
        return [
            (self.ids[a], self.ids[b])
            for a in kept
            for b in kept
            if a < b and float(np.hypot(*(px[a] - px[b]))) < MERGING_PX
        ]

    def _ranges_mm(self, placement: Placement) -> tuple[FloatArray, dict[str, str]]:
        """(n,) ranges where the beams meet the target, and the lasers whose beams miss it."""
        x, y, tx, ty = self.rays.T
        target, standoff_mm = placement.target, placement.standoff_mm
        if isinstance(target, FlatTarget):
            m, n = tan(radians(target.yaw_deg)), tan(radians(target.pitch_deg))
            at_plane = standoff_mm + m * (x + tx * self.offset_mm) + n * (y + ty * self.offset_mm)
            return np.asarray(at_plane / (1 - m * tx - n * ty), np.float64), {}
        ranges, causes = np.full(len(x), standoff_mm), {}
        if isinstance(target, CylinderTarget):
            radius_mm, aside = target.diameter_mm / 2, np.zeros(len(x))
            for _ in range(STEPS):
                aside = x + tx * (ranges + self.offset_mm) - target.shift_mm
                ranges = standoff_mm + radius_mm - np.sqrt(np.maximum(radius_mm**2 - aside**2, 0.0))
            for i, share in zip(self.ids, (np.abs(aside) / radius_mm).tolist(), strict=True):
                if share > STEEPEST_ON_CYLINDER:
                    causes[i] = "off the target" if share >= 1 else "grazes the target"
        return ranges, causes

    def _spots_px(self, ranges_mm: FloatArray) -> FloatArray:
        """(n, 2) positions of the spots at ranges (n,), one for each laser."""
        x, y, tx, ty = self.rays.T
        w = 1.0 / (ranges_mm + self.offset_mm)
        u_px, v_px = self.model.project(self.lens, tx + x * w, ty + y * w)
        return np.stack([np.asarray(u_px, np.float64), np.asarray(v_px, np.float64)], axis=1)

    def _is_in_image(self, laser: int, range_mm: float, px: FloatArray) -> bool:
        if range_mm <= 0 or not in_picture(px[None], self.size_px)[0]:
            return False
        x, y, tx, ty = self.rays[laser]
        w = 1.0 / (range_mm + self.offset_mm)
        return bool(self.model.is_unfolded(self.lens, np.array([tx + x * w]), np.array([ty + y * w]))[0])
