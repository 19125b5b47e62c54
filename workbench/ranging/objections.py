"""Why a spot has no range, and which ranges to take with care."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from workbench.calibration.sensor import Ranges
from workbench.model.calibration import Validity
from workbench.model.event import LaserRange

FloatArray = NDArray[np.float64]
MOST_MISFIT_SD = 6.0
"""A spot farther from its laser's line is another light: by chance one in 5e8 is."""
MOST_RELATIVE_SIGMA = 0.5
"""Beyond, the spot is so near to its place at infinity that its range may be anything."""


def objections(position_px: FloatArray, ranges: Ranges, size_px: tuple[int, int]) -> list[str | None]:
    """For each of n spots why it cannot give a range; None where it can.

    Args:
        position_px: (n, 2) u, v; NaN where a coordinate was not measured.
        ranges: what the sensor makes of them.
        size_px: (width, height) of the picture.
    """
    rows = zip(position_px, ranges.range_mm, ranges.sigma_mm, ranges.misfit_sd, strict=True)
    return [
        _objection(position, float(r), float(s), float(m), np.array(size_px, float))
        for position, r, s, m in rows
    ]


def _objection(
    position: FloatArray, range_mm: float, sigma_mm: float, misfit_sd: float, size: FloatArray
) -> str | None:
    seen = np.isfinite(position)
    if not (seen.any() and ((position > -0.5) & (position < size - 0.5))[seen].all()):
        return "its spot lies outside the picture"
    if not misfit_sd < MOST_MISFIT_SD:
        return (
            f"its spot lies {misfit_sd:.0f} sd off the laser's line: another light, or the sensor has moved"
        )
    if not np.isfinite(range_mm):
        return "its spot lies at or beyond the place of a target at infinity"
    if range_mm <= 0:
        return "its spot would lie behind the reference plane"
    if not sigma_mm < MOST_RELATIVE_SIGMA * range_mm:
        return f"its range of {range_mm:.0f} mm is known to {sigma_mm:.0f} mm only"
    return None


def outside_validity(lasers: tuple[LaserRange, ...], validity: Validity) -> list[str]:
    """A remark for each range that the calibration was not measured at."""
    nearest, farthest = validity.standoff_mm
    calibrated = f"{nearest:g} to {farthest:g}"
    return [
        f"{laser.laser_id}: {laser.range_mm:.0f} mm lies outside the calibrated {calibrated} mm"
        for laser in lasers
        if not nearest <= laser.range_mm <= farthest
    ]
