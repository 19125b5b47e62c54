"""Spots of lasers that were captured alone: on the laser's line, and of no other laser."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from workbench.ranging.assignment import MOST_MISFIT_SD
from workbench.ranging.ranger import spot_arrays
from workbench.sensor.calibrated import CalibratedSensor
from workbench.spots import Spot

SAME_SPOT_SD = 5.0
"""Difference of two spots or ranges, in standard deviations, up to which they are one."""


def spots_on_line(
    sensor: CalibratedSensor, captures: Sequence[tuple[str, Sequence[Spot]]]
) -> list[list[Spot]]:
    """Spots on the lines of lasers that were on alone; a single one is that of the laser.

    Args:
        sensor: the sensor.
        captures: each laser with the spots of its capture.
    """
    ids = [laser_id for laser_id, spots in captures for _ in spots]
    ranges = sensor.ranges(ids, *spot_arrays([spot for _, spots in captures for spot in spots]))
    possible = (ranges.range_mm > 0) & np.isfinite(ranges.range_mm)
    on_line = iter(((ranges.misfit_sd < MOST_MISFIT_SD) & possible).tolist())
    return [[spot for spot in spots if next(on_line)] for _, spots in captures]


def seen_twice(sensor: CalibratedSensor, known: Sequence[tuple[str, Spot]]) -> frozenset[str]:
    """Lasers whose spot is also that of another, at another range: they were on together, not alone.

    Args:
        sensor: the sensor.
        known: lasers that were on alone, each with its only spot.
    """
    ids = [laser_id for laser_id, _ in known]
    position, sd, speckle_sd = spot_arrays([spot for _, spot in known])
    found = sensor.ranges(ids, position, sd, speckle_sd)
    apart_px = np.abs(position[:, None] - position)
    is_one_place = (apart_px <= SAME_SPOT_SD * np.hypot(sd[:, None], sd)).all(axis=-1)
    apart_mm = np.abs(found.range_mm[:, None] - found.range_mm)
    differ = apart_mm > SAME_SPOT_SD * np.hypot(found.spot_sd_mm[:, None], found.spot_sd_mm)
    return frozenset(ids[i] for i in np.flatnonzero((is_one_place & differ).any(axis=1)))
