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
from workbench.ranging.objections import objections, outside_validity
from workbench.spots import Scanline, Spot

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
NOTHING_SEEN = "no spot was seen"
Status = Literal["done", "not_enough_points", "no_points"]
SCANLINE_HALF_WIDTH_PX = 8.0
"""A beam of 1.5 mm at the sensor's front spreads over some 8 px on either side of its line."""


@dataclass(frozen=True)
class Reading:
    """The ranger's answer to one scene; mm, 1 sigma."""

    scene: str
    status: Status
    closest_mm: float | None = None
    """The nearest laser's range."""
    sigma_mm: float | None = None
    lasers: tuple[LaserRange, ...] = ()
    """In the calibration's order."""
    flat_mm: float | None = None
    """Mean range of the lasers, weighted by their spots: the range of a flat target across the axis."""
    flat_sigma_mm: float | None = None
    notes: tuple[str, ...] = ()
    """Why lasers have no range, and which ranges to take with care."""


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
        against = objections(position_px, ranges, self.size_px)
        notes = [f"{i}: {why}" for i, why in zip(laser_ids, against, strict=True) if why is not None]
        good = np.array([why is None for why in against], bool)
        if not good.any():
            return Reading(scene, "no_points", notes=tuple(notes) or (NOTHING_SEEN,))
        lasers = _records(laser_ids, position_px, ranges, good)
        nearest = min(lasers, key=lambda laser: laser.range_mm)
        status: Status = "done" if len(lasers) == fired else "not_enough_points"
        flat_mm, flat_sigma_mm = _flat_range(ranges, good)
        notes += outside_validity(lasers, self.calibration.laser_ranger.validity)
        return Reading(
            scene,
            status,
            nearest.range_mm,
            nearest.sigma_mm,
            tuple(sorted(lasers, key=lambda laser: self.sensor.ids.index(laser.laser_id))),
            flat_mm,
            flat_sigma_mm,
            tuple(notes),
        )

    def read_lit(self, scene: str, spots: Sequence[Spot]) -> Reading:
        """Range the spots of a frame in which every laser is lit.

        As many spots as lasers are dealt to the lasers by `assign`. With fewer or more, or where the spots do
        not tell, the status is `not_enough_points` and there is no range: fire each laser alone instead.
        """
        if not spots:
            return Reading(scene, "no_points", notes=(NOTHING_SEEN,))
        position, sd = spot_arrays(spots)
        laser_ids = assign(self.sensor, position, sd)
        if laser_ids is None:
            seen, lasers = len(spots), len(self.sensor.ids)
            note = f"{seen} spots of {lasers} lasers cannot be told apart: fire each laser alone"
            return Reading(scene, "not_enough_points", notes=(note,))
        return self.read_known(scene, len(self.sensor.ids), laser_ids, position, sd)

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
