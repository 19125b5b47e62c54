"""Validity checks of spots and ranges: why a spot has no range, and ranges outside the calibration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.model.calibration import Validity
from workbench.model.event import LaserRange
from workbench.optics.image import in_picture, inside_px
from workbench.ranging.assignment import MOST_MISFIT_SD
from workbench.sensor.range_model import RangeEstimates

MOST_RELATIVE_SIGMA = 0.5
"""Largest relative uncertainty of a range; beyond it the spot lies too near its vanishing point."""
LEAST_BEYOND_PX = 0.5
"""Distance from the calibrated field below which no remark is made."""


def failed_checks(
    position_px: FloatArray, ranges: RangeEstimates, size_px: tuple[int, int]
) -> list[str | None]:
    """The failed validity check of each of n spots; None where its range is valid.

    Args:
        position_px: (n, 2) u, v; NaN where a coordinate was not measured.
        ranges: range estimates of the spots.
        size_px: (width, height) of the image.
    """
    failed: list[str | None] = []
    size = np.array(size_px, float)
    of_range = ranges.range_mm.tolist(), ranges.sigma_mm.tolist(), ranges.misfit_sd.tolist()
    inside = in_picture(position_px, size).tolist()
    for n, (range_mm, sigma_mm, misfit_sd) in enumerate(zip(*of_range, strict=True)):
        is_range = misfit_sd < MOST_MISFIT_SD and sigma_mm < MOST_RELATIVE_SIGMA * range_mm < inf
        if is_range and inside[n]:
            failed.append(None)
        else:
            failed.append(_failed_check(position_px[n], range_mm, sigma_mm, misfit_sd, size))
    return failed


def _failed_check(
    position: FloatArray, range_mm: float, sigma_mm: float, misfit_sd: float, size: FloatArray
) -> str | None:
    seen = np.isfinite(position)
    if not (seen.any() and inside_px(position, size)[seen].all()):
        return "its spot lies outside the image"
    if np.isnan(range_mm):
        return "its spot lies beyond the fold of the lens model, where the laser has no spot at any range"
    if not misfit_sd < MOST_MISFIT_SD:
        return (
            f"its spot lies {misfit_sd:.0f} sd from the laser's line: other light, or the sensor has changed"
        )
    if not np.isfinite(range_mm):
        return "its spot lies at or beyond the laser's vanishing point"
    if range_mm <= 0:
        return "its range lies behind the reference plane"
    if not sigma_mm < MOST_RELATIVE_SIGMA * range_mm:
        return f"its range of {range_mm:.0f} mm is too uncertain ({sigma_mm:.0f} mm, 1 sigma)"
    return None


def outside_validity(
    lasers: Sequence[LaserRange], validity: Validity, calibrated_px: Mapping[str, FloatArray]
) -> list[str]:
    """Remarks on ranges outside the calibration's standoffs, with the distance of the spot from its field.

    Args:
        lasers: the ranges.
        validity: nearest and farthest standoff of the calibration.
        calibrated_px: (2, 2) for each laser: u, v of its spot at these standoffs.
    """
    nearest, farthest = validity.standoff_mm
    remarks = []
    for laser in lasers:
        if nearest <= laser.range_mm <= farthest:
            continue
        calibrated = f"{nearest:g} to {farthest:g}"
        rounded = f"{laser.range_mm:.0f}"
        if nearest <= float(rounded) <= farthest:
            rounded = f"{laser.range_mm:.1f}"
        remark = f"{laser.laser_id}: {rounded} mm lies outside the calibrated {calibrated} mm"
        beyond = _beyond_px(laser, *calibrated_px[laser.laser_id])
        remarks.append(
            remark
            if beyond < LEAST_BEYOND_PX
            else f"{remark}, its spot {beyond:.1f} px outside the calibrated field"
        )
    return remarks


def _beyond_px(laser: LaserRange, near: FloatArray, far: FloatArray) -> float:
    """Distance of a spot from the calibrated part of its line, px; 0 inside."""
    along, length = near - far, float(np.hypot(*(near - far)))
    seen = np.array([far[n] if p is None else p for n, p in enumerate((laser.u_px, laser.v_px))])
    if length == 0:
        return float(np.hypot(*(seen - far)))
    place = float((seen - far) @ along) / length
    return max(place - length, -place, 0.0)
