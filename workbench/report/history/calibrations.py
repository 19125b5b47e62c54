"""Change of a sensor's ranges between two calibrations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.calibration.verdict.comparison import Comparison, compare
from workbench.model.calibration import Calibration
from workbench.model.errors import BadInputError
from workbench.sensor.calibrated import CalibratedSensor

FIVE_MM = (200.0, 500.0, 1000.0, 2000.0, 4000.0)
"""Distances at which calibrations are compared."""


@dataclass(frozen=True)
class RangeChange:
    """Change of the mean range of the lasers between two calibrations, at one distance; mm, 1 sigma."""

    range_mm: float
    change_mm: float
    sd_mm: float


def range_changes(before: Calibration, after: Calibration) -> tuple[RangeChange, ...]:
    """Mean change at the five distances, as far as both calibrations cover them.

    The range by `after` of the spot that `before` predicts, minus the range; the mean of the lasers that see
    it, weighted equally. The standard deviations of both calibrations are taken as independent.
    """
    a, b = CalibratedSensor(before), CalibratedSensor(after)
    spans = [c.laser_ranger.validity.standoff_mm for c in (before, after)]
    nearest, farthest = max(s[0] for s in spans), min(s[1] for s in spans)
    changes = []
    for range_mm in FIVE_MM:
        at = np.array([range_mm])
        ids = [i for i in a.ids if i in b.ids and a.in_frame(i, at)[0]]
        if nearest <= range_mm <= farthest and ids:
            changes.append(_change(a, b, ids, range_mm))
    return tuple(changes)


def compared(before: Calibration, after: Calibration) -> Comparison | None:
    """Test whether the sensor changed; None if the calibrations cannot be compared."""
    try:
        return compare(before, after)
    except BadInputError:
        return None


def _change(a: CalibratedSensor, b: CalibratedSensor, ids: list[str], range_mm: float) -> RangeChange:
    spots = np.concatenate([a.spot_px(i, np.array([range_mm])) for i in ids])
    typical = np.full_like(spots, np.nan)
    share = np.full(len(ids), 1 / len(ids))
    by_a, by_b = (sensor.ranges(ids, spots, typical) for sensor in (a, b))
    variance = 0.0
    for found in (by_a, by_b):  # the spots are equal: only the calibrations' uncertainty counts
        own = found.covariance_mm2 - np.diag(found.spot_sd_mm**2)
        variance += float(share @ own @ share)
    return RangeChange(range_mm, float(share @ (by_b.range_mm - range_mm)), float(np.sqrt(variance)))
