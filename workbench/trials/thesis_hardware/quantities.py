"""Quantities of the hardware tests: error, true value and uncertainties of one reading; kinds of targets."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from workbench.model.event import ReadingTaken, TrueValues
from workbench.trials.errors import ErrorStatistics, error_statistics

Number = float | None
Select = Callable[[ReadingTaken], bool]
"""Whether a reading belongs to a test."""


@dataclass(frozen=True)
class Quantity:
    """Quantity of a reading, in mm or degrees."""

    name: str
    unit: str
    measured: Callable[[ReadingTaken], Number]
    stated_sd: Callable[[ReadingTaken], Number]
    true: Callable[[ReadingTaken], Number]
    reference_sd: Callable[[ReadingTaken], Number]

    def errors(self, readings: Sequence[ReadingTaken]) -> list[Number]:
        """Measured - true of each reading; None where one is missing."""
        pairs = [(self.measured(reading), self.true(reading)) for reading in readings]
        return [None if one is None or true is None else one - true for one, true in pairs]

    def statistics(self, readings: Sequence[ReadingTaken]) -> ErrorStatistics:
        """Statistics of the errors at one placement."""
        stated = [self.stated_sd(reading) for reading in readings]
        return error_statistics(self.errors(readings), stated, self.reference_sd(readings[0]) or 0.0)


def _of_true(value: Callable[[TrueValues], Number]) -> Callable[[ReadingTaken], Number]:
    return lambda reading: None if reading.true is None else value(reading.true)


MEAN_RANGE = Quantity(
    "mean range",
    "mm",
    lambda r: r.range_mm,
    lambda r: r.sigma_mm,
    lambda r: r.reference_mm,
    lambda r: r.reference_sd_mm,
)
"""Mean range of the lasers, of readings of the accuracy trial."""
CLOSEST_RANGE = Quantity(
    "closest range",
    "mm",
    lambda r: r.closest_mm,
    lambda r: r.closest_sigma_mm,
    lambda r: r.reference_mm,
    lambda r: r.reference_sd_mm,
)
"""Closest range, the number that `workbench range` prints."""
CYLINDER_RANGE = Quantity(
    "cylinder range",
    "mm",
    lambda r: r.cylinder_mm,
    lambda r: r.cylinder_sd_mm,
    lambda r: r.reference_mm,
    lambda r: r.reference_sd_mm,
)
ANGLE = Quantity(
    "angle",
    "deg",
    lambda r: r.angle_deg,
    lambda r: r.angle_sd_deg,
    _of_true(lambda true: true.angle_deg),
    _of_true(lambda true: true.angle_sd_deg),
)
RADIUS = Quantity(
    "radius",
    "mm",
    lambda r: r.radius_mm,
    lambda r: r.radius_sd_mm,
    _of_true(lambda true: true.radius_mm),
    _of_true(lambda true: true.radius_sd_mm),
)


def is_mean(reading: ReadingTaken) -> bool:
    """Whether the range is the mean of the lasers in front of a measured flat target."""
    return reading.true is None and reading.is_measured


def is_without(left_off: int) -> Select:
    """Whether the closest range is that of a flat and square target with this number of lasers left off."""
    return lambda r: len(r.left_off) == left_off and not r.blocked and _is_square(r)


def is_incline(*angles_deg: float) -> Select:
    """Whether the target is an incline of one of these angles."""
    return lambda reading: _true_angle(reading) in angles_deg


def is_round(reading: ReadingTaken) -> bool:
    """Whether the target is a cylinder."""
    return reading.true is not None and reading.true.radius_mm is not None


def by_placement(readings: Sequence[ReadingTaken], select: Select, to_mm: float) -> list[list[ReadingTaken]]:
    """Selected readings with a true range up to `to_mm`, grouped by placement, nearest first."""
    groups: dict[tuple[float, str], list[ReadingTaken]] = {}
    for reading in readings:
        if select(reading) and reading.reference_mm <= to_mm + 0.5:
            groups.setdefault(place(reading), []).append(reading)
    return [groups[key] for key in sorted(groups)]


def place(reading: ReadingTaken) -> tuple[float, str]:
    """True range, mm, and key of the placement of a reading, which its scene begins with."""
    parts_after = 2 if reading.left_off else 1
    return reading.reference_mm, reading.scene.rsplit("/", parts_after)[0]


def _is_square(reading: ReadingTaken) -> bool:
    return reading.true is not None and not is_round(reading) and _true_angle(reading) is None


def _true_angle(reading: ReadingTaken) -> float | None:
    """Angle as set, without its sign; None for a target that is no incline."""
    if reading.true is None or reading.true.angle_deg is None:
        return None
    return abs(reading.true.angle_deg if reading.true.set_deg is None else reading.true.set_deg)
