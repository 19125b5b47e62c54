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
BoolArray = NDArray[np.bool_]
Status = Literal["done", "not_enough_points", "no_points"]
MOST_MISFIT_SD = 6.0
"""A spot farther from its laser's line is another light: by chance one in 5e8 is."""
MOST_RELATIVE_SIGMA = 0.5
"""Beyond, the spot is so near to its place at infinity that its range may be anything."""
SCANLINE_HALF_WIDTH_PX = 8.0
"""A beam of 1.5 mm at the sensor's front spreads over some 8 px on either side of its line."""


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
        ranges = self.sensor.ranges(laser_ids, position_px, sd_px)
        good = self._usable(position_px, ranges)
        if not good.any():
            return Reading(scene, "no_points", None, None, (), None, None)
        lasers = _records(laser_ids, position_px, ranges, good)
        nearest = min(lasers, key=lambda laser: laser.range_mm)
        status: Status = "done" if len(lasers) == fired else "not_enough_points"
        return Reading(scene, status, nearest.range_mm, nearest.sigma_mm, lasers, *_flat_range(ranges, good))

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

    def _usable(self, position_px: FloatArray, ranges: Ranges) -> BoolArray:
        """(n,) spots that lie in the picture, on their laser's line, and before the range means nothing."""
        size = np.array(self.size_px, float)
        inside = np.isnan(position_px) | ((position_px > -0.5) & (position_px < size - 0.5))
        with np.errstate(invalid="ignore"):
            known = np.isfinite(ranges.range_mm) & (ranges.range_mm > 0)
            sharp = ranges.sigma_mm < MOST_RELATIVE_SIGMA * ranges.range_mm
        return np.asarray(inside.all(axis=1) & known & sharp & (ranges.misfit_sd < MOST_MISFIT_SD))

    def _scanline(self, laser_id: str, nearest_mm: float) -> Scanline:
        near, far = self.sensor.spot_px(laser_id, np.array([nearest_mm, np.inf]))
        return Scanline(far[0], far[1], near[0] - far[0], near[1] - far[1], SCANLINE_HALF_WIDTH_PX)


def spot_arrays(spots: Sequence[Spot]) -> tuple[FloatArray, FloatArray]:
    """(n, 2) positions and (n, 2) standard deviations."""
    position = np.array([(s.u_px, s.v_px) for s in spots]).reshape(-1, 2)
    sd = np.array([(s.u_sd_px, s.v_sd_px) for s in spots]).reshape(-1, 2)
    return position, sd


def _records(
    laser_ids: Sequence[str], position_px: FloatArray, ranges: Ranges, good: BoolArray
) -> tuple[LaserRange, ...]:
    rows = zip(laser_ids, ranges.range_mm, ranges.sigma_mm, position_px, good, strict=True)
    return tuple(
        LaserRange(
            laser_id=i,
            range_mm=float(r),
            sigma_mm=float(s),
            u_px=None if np.isnan(p[0]) else float(p[0]),
            v_px=None if np.isnan(p[1]) else float(p[1]),
        )
        for i, r, s, p, usable in rows
        if usable
    )


def _flat_range(ranges: Ranges, good: BoolArray) -> tuple[float, float]:
    """Mean weighted by the spots' variances; its sigma from the full covariance.

    The calibration's part is common to the lasers: weights by the full covariance would lean on differences
    of nearly equal numbers for a gain that no bench would show.
    """
    weight = 1.0 / ranges.spot_sd_mm[good] ** 2
    weight = weight / weight.sum()
    covariance = ranges.covariance_mm2[np.ix_(good, good)]
    return float(weight @ ranges.range_mm[good]), float(np.sqrt(weight @ covariance @ weight))
