"""Why a spot has no range, and which ranges to take with care."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.model.calibration import Validity
from workbench.model.event import LaserRange
from workbench.optics.image import in_picture, inside_px
from workbench.ranging.assignment import MOST_MISFIT_SD
from workbench.sensor.calibrated import RangeEstimates

MOST_RELATIVE_SIGMA = 0.5
"""Beyond, the spot is so near to its place at infinity that its range may be anything."""
LEAST_BEYOND_PX = 0.5
"""Beyond the calibrated field by less than this is not worth telling."""


def objections(position_px: FloatArray, ranges: RangeEstimates, size_px: tuple[int, int]) -> list[str | None]:
    """For each of n spots why it cannot give a range; None where it can.

    Args:
        position_px: (n, 2) u, v; NaN where a coordinate was not measured.
        ranges: what the sensor makes of them.
        size_px: (width, height) of the picture.
    """
    why: list[str | None] = [None] * len(position_px)
    bound = MOST_RELATIVE_SIGMA * ranges.range_mm
    good = (ranges.misfit_sd < MOST_MISFIT_SD) & (ranges.sigma_mm < bound) & np.isfinite(ranges.range_mm)
    good &= in_picture(position_px, size_px)
    for n in np.flatnonzero(~good).tolist():
        range_mm, sigma_mm, misfit_sd = ranges.range_mm[n], ranges.sigma_mm[n], ranges.misfit_sd[n]
        why[n] = _objection(position_px[n], range_mm, sigma_mm, misfit_sd, np.array(size_px, float))
    return why


def _objection(
    position: FloatArray, range_mm: float, sigma_mm: float, misfit_sd: float, size: FloatArray
) -> str | None:
    seen = np.isfinite(position)
    if not (seen.any() and inside_px(position, size)[seen].all()):
        return "its spot lies outside the picture"
    if np.isnan(range_mm):
        return "its spot lies where the lens model folds over: at no range would it be seen there"
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


def outside_validity(
    lasers: Sequence[LaserRange], validity: Validity, calibrated_px: Mapping[str, FloatArray]
) -> list[str]:
    """A remark for each range that the calibration was not measured at, and how far off the spot lies.

    Args:
        lasers: ranges.
        validity: nearest and farthest standoff of the calibration.
        calibrated_px: (2, 2) for each laser: u, v of its spot at these.
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
    """How far a spot lies outside the part of its line where the calibration saw it (0: inside)."""
    along, length = near - far, float(np.hypot(*(near - far)))
    seen = np.array([far[n] if p is None else p for n, p in enumerate((laser.u_px, laser.v_px))])
    if length == 0:
        return float(np.hypot(*(seen - far)))
    place = float((seen - far) @ along) / length
    return max(place - length, -place, 0.0)
