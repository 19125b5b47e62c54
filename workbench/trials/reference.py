"""True ranges of a flat target: ruler reading, scale of the ruler, and tilt of the target.

The true range at the point (x, y) of a beam is standoff x (1 + scale) + m x + n y. The slopes m and n are
those of the target about the vertical and the horizontal axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, reduce
from math import hypot, isfinite, radians, sqrt, tan

import numpy as np
from scipy.special import ndtri

from workbench.model.arrays import FloatArray
from workbench.model.event import LaserRange
from workbench.model.rig import BenchSpec
from workbench.model.target import Placement
from workbench.sensor.calibrated import CalibratedSensor, X, Y
from workbench.sensor.range_model import RangeEstimates

NODES = 31
"""Number of values of each random tilt: gives variances to some 5 %."""
Shared = Sequence[float] | FloatArray
Point = tuple[float, float]


def true_ranges_mm(standoff_mm: float, shared: Shared, places_mm: FloatArray) -> FloatArray:
    """(n,) true ranges at n points of a flat target, mm.

    Args:
        standoff_mm: ruler reading.
        shared: (3,) relative error of the ruler, slopes of the target about the vertical and the horizontal.
        places_mm: (n, 2) x and y of the points.
    """
    scale, slope_x, slope_y = shared
    slopes = np.array([slope_x, slope_y])
    return np.asarray(standoff_mm * (1.0 + scale) + places_mm @ slopes, np.float64)


def standoff_sd_mm(placed: Placement, bench: BenchSpec) -> float:
    """Standard uncertainty of reading the standoff: of the placement, otherwise that of the rig's bench."""
    return bench.placement_sd_mm if placed.standoff_sd_mm is None else placed.standoff_sd_mm


@dataclass(frozen=True)
class TiltEffect:
    """Effect of the target's tilt on one true range, mm."""

    shift_mm: float
    """Expected change of the true range from that on the optical axis."""
    own_sd_mm: float
    """1 sigma by the tilt of one placement."""
    common_mm: tuple[float, float]
    """1 sigma by the two slopes common to all placements, signed: fully correlated between placements."""

    @classmethod
    def mean(cls, effects: Sequence[TiltEffect]) -> TiltEffect:
        """Mean effect on the readings at one placement, whose tilt is the same."""
        shift, own, x, y = np.mean(
            [(e.shift_mm, e.own_sd_mm, *e.common_mm) for e in effects], axis=0
        ).tolist()
        return cls(shift, own, (x, y))

    @property
    def sd_mm(self) -> float:
        """1 sigma by all tilts."""
        return hypot(self.own_sd_mm, *self.common_mm)


ON_AXIS = TiltEffect(0.0, 0.0, (0.0, 0.0))
"""No effect: the range on the optical axis."""


@dataclass(frozen=True)
class Reference:
    """True ranges at one placement of a flat target, and their standard uncertainties."""

    standoff_mm: float
    """Ruler reading."""
    standoff_sd_mm: float
    tilt: tuple[float, float] = (0.0, 0.0)
    """Slopes of the tilt common to all placements, as measured, about the vertical and the horizontal."""
    tilt_sd: float = 0.0
    """Standard uncertainty of the tilt at one placement about each axis, rad."""
    common_tilt_sd: float = 0.0
    """Standard uncertainty of the tilt common to all placements about each axis, rad."""
    scale: float = 0.0
    """Relative error of the ruler."""
    scale_sd: float = 0.0
    """Standard uncertainty of `scale`."""

    @classmethod
    def of(cls, bench: BenchSpec, placed: Placement) -> Reference:
        """Reference of a placement; without a stated uncertainty that of the rig's bench counts."""
        return cls(
            placed.standoff_mm,
            standoff_sd_mm(placed, bench),
            (tan(radians(bench.target_yaw_deg)), tan(radians(bench.target_pitch_deg))),
            radians(bench.tilt_sd_deg),
            radians(bench.target_tilt_sd_deg),
            bench.ruler_scale.value,
            bench.ruler_scale.sd,
        )

    def at_point(self, place_mm: Point) -> TiltEffect:
        """Effect of the tilt at the point (x, y), mm: linear in the slopes."""
        x_mm, y_mm = place_mm
        return TiltEffect(
            self.tilt[0] * x_mm + self.tilt[1] * y_mm,
            self.tilt_sd * hypot(x_mm, y_mm),
            (self.common_tilt_sd * x_mm, self.common_tilt_sd * y_mm),
        )

    def at_near_end(self, ends_mm: tuple[Point, ...]) -> TiltEffect:
        """Effect of the tilt on the smallest range over the ends (x, y) of the front, mm; see `near_end`."""
        return near_end(ends_mm, self.tilt, self.tilt_sd, self.common_tilt_sd)

    def true_mm(self, effect: TiltEffect) -> float:
        """Expected true range."""
        (on_axis_mm,) = true_ranges_mm(self.standoff_mm, (self.scale, 0.0, 0.0), np.zeros((1, 2)))
        return float(on_axis_mm) + effect.shift_mm

    def own_sd_mm(self, effect: TiltEffect) -> float:
        """1 sigma by the placement alone: reading of the ruler and own tilt."""
        return hypot(self.standoff_sd_mm, effect.own_sd_mm)

    def lasers_true_mm(self, sensor: CalibratedSensor, lasers: Sequence[LaserRange]) -> tuple[float, ...]:
        """Expected true range of each laser at its place on the target."""
        places = laser_places(sensor, lasers).tolist()
        return tuple(self.true_mm(self.at_point((x_mm, y_mm))) for x_mm, y_mm in places)

    def sd_mm(self, effect: TiltEffect) -> float:
        """1 sigma by all sources: placement, common tilt, and scale of the ruler."""
        return hypot(self.standoff_sd_mm, effect.sd_mm, self.scale_sd * self.standoff_mm)


@lru_cache(maxsize=256)
def near_end(
    ends_mm: tuple[Point, ...], tilt: tuple[float, float], own_sd: float, common_sd: float
) -> TiltEffect:
    """Effect of a target's tilt on its smallest range over the front.

    A random tilt always brings one end nearer. For one line from -a to a and a normal slope of sd s the
    smallest range is shorter by 0.80 s a on average, with the standard deviation 0.60 s a. The first is the
    correction of a systematic effect, the second its remaining uncertainty (GUM 3.2.4). Both are computed for
    any front and any measured tilt, by a product grid of equally probable values of own and common slopes.

    Args:
        ends_mm: ends (x, y) of the lines of lasers.
        tilt: slopes common to all placements, as measured.
        own_sd: 1 sigma of the slopes at one placement.
        common_sd: 1 sigma of the slopes common to all placements.
    """
    ends = np.array(ends_mm)
    own_x, own_y, common_x, common_y = np.meshgrid(
        *(_values(sd if ends[:, k].any() else 0.0) for sd in (own_sd, common_sd) for k in (0, 1)),
        indexing="ij",
        sparse=True,
    )
    slope_x, slope_y = tilt[0] + own_x + common_x, tilt[1] + own_y + common_y
    least = reduce(np.minimum, (slope_x * x_mm + slope_y * y_mm for x_mm, y_mm in ends_mm))
    given_common = least.mean(axis=(0, 1))
    common_mm = float(given_common.std())
    own_mm = sqrt(max(float(least.var()) - common_mm**2, 0.0))
    return TiltEffect(float(least.mean()), own_mm, (common_mm, 0.0))


def laser_estimates(sensor: CalibratedSensor, lasers: Sequence[LaserRange]) -> RangeEstimates:
    """Estimates of n lasers from their spots, with the noise in the calibration."""
    position = np.array([[_number(one.u_px), _number(one.v_px)] for one in lasers]).reshape(-1, 2)
    return sensor.ranges([one.laser_id for one in lasers], position, np.full_like(position, np.nan))


def laser_places(sensor: CalibratedSensor, lasers: Sequence[LaserRange]) -> FloatArray:
    """(n, 2) x and y of the spots of n lasers, mm."""
    return places_of(sensor, lasers, laser_estimates(sensor, lasers))


def places_of(
    sensor: CalibratedSensor, lasers: Sequence[LaserRange], estimates: RangeEstimates
) -> FloatArray:
    """(n, 2) x and y of the spots of n lasers with these estimates, mm."""
    ids = [one.laser_id for one in lasers]
    return np.stack([sensor.places(ids, axis, estimates)[0] for axis in (X, Y)], axis=1)


def front_ends(sensor: CalibratedSensor, range_mm: float) -> tuple[Point, ...]:
    """Ends (x, y) of the rows of lasers at a range, mm; a row about the optical axis is taken as on it."""
    ends: list[Point] = []
    for row in sensor.rows:
        x, y = row.direction.tolist()
        front, across = sensor.front_mm(row, range_mm), sensor.across_mm(row, range_mm)
        ends += [(x * end - y * across, y * end + x * across) for end in front]
    return tuple(ends)


def _number(px: float | None) -> float:
    return np.nan if px is None or not isfinite(px) else px


def _values(sd: float) -> FloatArray:
    """Equally probable values of a normal error with this standard deviation; a single 0 without one."""
    if sd == 0:
        return np.zeros(1)
    values: FloatArray = np.asarray(ndtri((np.arange(NODES) + 0.5) / NODES), np.float64)
    return np.asarray(sd * values / values.std(), np.float64)
