"""The ranger: spots and a calibration in, ranges with their uncertainty out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from workbench.calibration.sensor import Ranges, Sensor
from workbench.model.calibration import Calibration
from workbench.model.event import LaserRange
from workbench.ranging.assignment import assign
from workbench.spots import Scanline, Spot

FloatArray = NDArray[np.float64]
Status = Literal["done", "not_enough_points", "no_points"]
SCANLINE_HALF_WIDTH_PX = 8.0
"""A beam of 1.5 mm at the sensor's front spreads over some 8 px on either side of its line."""


@dataclass(frozen=True)
class Located:
    """Spots with known lasers and their ranges."""

    laser_ids: tuple[str, ...]
    position_px: FloatArray
    """(n, 2)"""
    ranges: Ranges

    def records(self) -> tuple[LaserRange, ...]:
        """One record a laser that has a range, in the order of the spots."""
        rows = zip(self.laser_ids, self.ranges.range_mm, self.ranges.sigma_mm, self.position_px, strict=True)
        return tuple(
            LaserRange(
                laser_id=i,
                range_mm=float(r),
                sigma_mm=float(s),
                u_px=None if np.isnan(p[0]) else float(p[0]),
                v_px=None if np.isnan(p[1]) else float(p[1]),
            )
            for i, r, s, p in rows
            if np.isfinite(r)
        )


@dataclass(frozen=True)
class Reading:
    """The ranger's answer to one scene; mm, 1 sigma."""

    scene: str
    status: Status
    closest_mm: float | None
    """The nearest laser's range."""
    sigma_mm: float | None
    lasers: tuple[LaserRange, ...]
    flat_mm: float | None
    """Mean range of the lasers, weighted by their spots: the range of a flat target across the axis."""
    flat_sigma_mm: float | None


@dataclass(frozen=True)
class Ranger:
    """Consumes a calibration, and nothing else."""

    calibration: Calibration

    @cached_property
    def sensor(self) -> Sensor:
        """The calibration as arrays."""
        return Sensor(self.calibration)

    @property
    def size_px(self) -> tuple[int, int]:
        """(width, height) that frames must have."""
        return self.calibration.image_width, self.calibration.image_height

    @cached_property
    def scanlines(self) -> tuple[Scanline, ...]:
        """The line in the image along which each laser's spot moves with range."""
        nearest, _ = self.calibration.laser_ranger.validity.standoff_mm
        return tuple(self._scanline(i, nearest) for i in self.sensor.ids)

    def read_known(
        self, scene: str, fired: int, laser_ids: Sequence[str], position_px: FloatArray, sd_px: FloatArray
    ) -> Reading:
        """Range spots whose lasers are known, because each was fired alone.

        Args:
            scene: name of the scene.
            fired: how many lasers were fired; fewer spots make the status `not_enough_points`.
            laser_ids: n lasers.
            position_px: (n, 2), NaN where a coordinate was not measured.
            sd_px: (n, 2) 1 sigma, NaN where not known.
        """
        if not len(laser_ids):
            return Reading(scene, "no_points", None, None, (), None, None)
        located = Located(tuple(laser_ids), position_px, self.sensor.ranges(laser_ids, position_px, sd_px))
        lasers = located.records()
        if not lasers:
            return Reading(scene, "no_points", None, None, (), None, None)
        nearest = min(lasers, key=lambda laser: laser.range_mm)
        status: Status = "done" if len(lasers) == fired else "not_enough_points"
        return Reading(
            scene, status, nearest.range_mm, nearest.sigma_mm, lasers, *_flat_range(located.ranges)
        )

    def read_lit(self, scene: str, spots: Sequence[Spot]) -> Reading:
        """Range the spots of a frame in which every laser is lit.

        As many spots as lasers are dealt to the lasers by `assign`. With fewer or more, or where the spots do
        not tell, the status is `not_enough_points` and there is no range: fire each laser alone instead.
        """
        if not spots:
            return Reading(scene, "no_points", None, None, (), None, None)
        position, sd = spot_arrays(spots)
        laser_ids = assign(self.sensor, position, sd)
        if laser_ids is None:
            return Reading(scene, "not_enough_points", None, None, (), None, None)
        return self.read_known(scene, len(self.sensor.ids), laser_ids, position, sd)

    def _scanline(self, laser_id: str, nearest_mm: float) -> Scanline:
        near, far = self.sensor.spot_px(laser_id, np.array([nearest_mm, np.inf]))
        return Scanline(far[0], far[1], near[0] - far[0], near[1] - far[1], SCANLINE_HALF_WIDTH_PX)


def spot_arrays(spots: Sequence[Spot]) -> tuple[FloatArray, FloatArray]:
    """(n, 2) positions and (n, 2) standard deviations."""
    position = np.array([(s.u_px, s.v_px) for s in spots]).reshape(-1, 2)
    sd = np.array([(s.u_sd_px, s.v_sd_px) for s in spots]).reshape(-1, 2)
    return position, sd


def _flat_range(ranges: Ranges) -> tuple[float, float]:
    """Mean weighted by the spots' variances; its sigma from the full covariance.

    The calibration's part is common to the lasers: weights by the full covariance would lean on differences
    of nearly equal numbers for a gain that no bench would show.
    """
    finite = np.isfinite(ranges.range_mm)
    weight = np.where(finite, 1.0 / ranges.spot_sd_mm**2, 0.0)
    weight = weight / weight.sum()
    mean = float(weight[finite] @ ranges.range_mm[finite])
    covariance = ranges.covariance_mm2[np.ix_(finite, finite)]
    return mean, float(np.sqrt(weight[finite] @ covariance @ weight[finite]))
