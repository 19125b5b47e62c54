"""Causes of errors besides noise and calibration, each with its computed size."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import hypot, radians
from statistics import fmean

from workbench.model.event import ReadingTaken
from workbench.model.rig import Rig
from workbench.trials.errors import EXPANSION

Size = Callable[[Sequence[ReadingTaken], Rig], float | None]
"""Size of a cause at one placement, in the unit of the quantity; None: not known."""


@dataclass(frozen=True)
class Cause:
    """Cause of an error that may exceed a goal."""

    text: str
    size: Size
    is_in_u: bool
    """Whether the stated uncertainty includes it: then it explains no error beyond U."""


def _near_end_mm(readings: Sequence[ReadingTaken], rig: Rig) -> float:
    """Lead of the near end of a flat target by its tilt (k = 2), at the arm of the outermost laser."""
    arm_mm = max(hypot(one.x_mm.value, one.y_mm.value) for one in rig.lasers)
    tilt_deg = hypot(rig.bench.tilt_sd_deg, rig.bench.target_tilt_sd_deg)
    return EXPANSION * radians(tilt_deg) * arm_mm


def _common_tilt_deg(readings: Sequence[ReadingTaken], rig: Rig) -> float:
    """Tilt common to all placements (k = 2)."""
    return EXPANSION * rig.bench.target_tilt_sd_deg


def _parabola_mm(readings: Sequence[ReadingTaken], rig: Rig) -> float | None:
    """Difference of the closest range by the parabola from that by the cylinder; None without a cylinder."""
    pairs = [(r.closest_mm, r.cylinder_mm) for r in readings]
    found = [a - b for a, b in pairs if a is not None and b is not None]
    return abs(fmean(found)) if found else None


TILT = Cause(
    "the target's squareness: its near end is closer than the ruler shows",
    _near_end_mm,
    is_in_u=True,
)
PARABOLA = Cause(
    "the printed range is that of a parabola, which four lasers cannot distinguish from a circle",
    _parabola_mm,
    is_in_u=False,
)
COMMON_TILT = Cause(
    "the tilt common to all placements; it cancels in the difference of two angles",
    _common_tilt_deg,
    is_in_u=True,
)
