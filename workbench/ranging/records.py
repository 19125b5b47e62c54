"""Ranges as records of a reading, and as one number."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, sqrt

from workbench.model.arrays import FloatArray
from workbench.model.event import LaserRange
from workbench.ranging.points import interval_mm
from workbench.sensor.range_model import RangeEstimates
from workbench.spots import Failure, Spot

FLAGGED = {
    Failure.SATURATED: "is saturated: its range is less certain",
    Failure.BLOOMING: "has spilled charge along its column: it may be anywhere in the streak",
    Failure.MERGED: "overlaps another: the errors of both ranges are correlated",
    Failure.AT_EDGE: "is cut by the edge of the image",
}
"""Text of the flags of a spot that affect its range."""


def flag_notes(laser_ids: Sequence[str], spots: Sequence[Spot]) -> list[str]:
    """Notes on the flags of n spots, with their lasers."""
    return [
        f"{laser_id}: its spot {words}"
        for laser_id, spot in zip(laser_ids, spots, strict=True)
        if spot.flags
        for flag, words in FLAGGED.items()
        if flag in spot.flags
    ]


def laser_ranges(
    laser_ids: Sequence[str], position_px: FloatArray, ranges: RangeEstimates, offset_mm: float
) -> tuple[LaserRange, ...]:
    """Records of n ranges; positions (n, 2), NaN where a coordinate was not measured."""
    records = []
    columns = zip(
        laser_ids, ranges.range_mm.tolist(), ranges.sigma_mm.tolist(), position_px.tolist(), strict=True
    )
    for laser_id, range_mm, sigma_mm, (u, v) in columns:
        low, high = interval_mm(range_mm, sigma_mm, offset_mm)
        records.append(
            LaserRange(
                laser_id=laser_id,
                range_mm=range_mm,
                sigma_mm=sigma_mm,
                u_px=u if isfinite(u) else None,
                v_px=v if isfinite(v) else None,
                low_mm=low,
                high_mm=high if isfinite(high) else None,
            )
        )
    return tuple(records)


def flat_range(ranges: RangeEstimates) -> tuple[float, float, float]:
    """Mean range weighted by the spots' variances, its sigma by all sources, and by the spots alone, mm.

    The calibration's error is nearly common to all lasers: weights by the full covariance would depend on
    small differences of its entries, for no measurable gain.
    """
    information = ranges.spot_sd_mm**-2
    total = float(information.sum())
    weight = information / total
    sigma_mm = sqrt(weight @ ranges.covariance_mm2 @ weight)
    return float(weight @ ranges.range_mm), sigma_mm, 1.0 / sqrt(total)
