"""Rows of the comparison: what the thesis found, what the workbench finds, and the goal.

Source: D. L. Tran, "Obstacle Detection for Robot Navigation Using Structured Light", M.Eng. thesis, MIT,
2001, section 7.2.2. Errors are relative absolute values, the mean of the readings at a range; a row has the
largest of its ranges. The thesis's values are stated in its text or read off its figures.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf
from statistics import fmean
from typing import Literal

from workbench.model.event import ReadingTaken
from workbench.model.rig import Rig
from workbench.trials.errors import ErrorStatistics
from workbench.trials.limits import Result
from workbench.trials.thesis_hardware.causes import COMMON_TILT, PARABOLA, TILT, Cause
from workbench.trials.thesis_hardware.quantities import (
    ANGLE,
    CLOSEST_RANGE,
    CYLINDER_RANGE,
    MEAN_RANGE,
    RADIUS,
    Quantity,
    Select,
    by_placement,
    is_incline,
    is_mean,
    is_round,
    is_without,
    place,
)

Measure = Literal["error", "sd"]
RATIO_GOAL = 1.5
"""Largest accepted mean error with lasers left off, in units of that with all lasers."""


@dataclass(frozen=True)
class Claim:
    """One value of the thesis."""

    figure: str
    target: str
    quantity: Quantity
    select: Select
    measure: Measure = "error"
    to_mm: float = inf
    thesis: float | None = None
    """Relative error, or standard deviation in the unit of the quantity; None: the thesis states none."""
    goal: float | None = None
    """Largest relative error that the workbench aims at."""
    cause: Cause | None = None
    """Cause of the error besides noise and calibration; None: none is known."""


CLAIMS = (
    Claim("33", "flat", MEAN_RANGE, is_mean, to_mm=200, thesis=0.025, goal=0.005),
    Claim("33", "flat", MEAN_RANGE, is_mean, to_mm=2000, thesis=0.025, goal=0.005),
    Claim("33", "flat", MEAN_RANGE, is_mean, to_mm=4500, thesis=0.035, goal=0.01),
    Claim("33", "flat", CLOSEST_RANGE, is_without(0), to_mm=2000, thesis=0.025, goal=0.005, cause=TILT),
    Claim("33", "flat", CLOSEST_RANGE, is_without(0), to_mm=4500, thesis=0.035, goal=0.01, cause=TILT),
    Claim("34", "flat", MEAN_RANGE, is_mean, "sd", thesis=40.0),
    Claim("7.2.2", "1 off", CLOSEST_RANGE, is_without(1), thesis=0.06),
    Claim("7.2.2", "3 off", CLOSEST_RANGE, is_without(3), thesis=0.06),
    Claim("35", "30 deg", CLOSEST_RANGE, is_incline(30), thesis=0.06),
    Claim("36", "60 deg", CLOSEST_RANGE, is_incline(60), thesis=0.06),
    Claim("37", "30 deg", ANGLE, is_incline(30), to_mm=500, thesis=0.25, goal=0.02, cause=COMMON_TILT),
    Claim("37", "30 deg", ANGLE, is_incline(30), to_mm=1000, thesis=0.25, goal=0.05, cause=COMMON_TILT),
    Claim("38", "60 deg", ANGLE, is_incline(60), to_mm=500, thesis=0.08, goal=0.02, cause=COMMON_TILT),
    Claim("38", "60 deg", ANGLE, is_incline(60), to_mm=1000, thesis=0.08, goal=0.05, cause=COMMON_TILT),
    Claim("39", "inclines", CLOSEST_RANGE, is_incline(30, 60), "sd", thesis=6.0),
    Claim("40", "inclines", ANGLE, is_incline(30, 60), "sd", thesis=4.0),
    Claim("41", "cylinder", CLOSEST_RANGE, is_round, thesis=0.05, goal=0.005, cause=PARABOLA),
    Claim("41", "cylinder", CYLINDER_RANGE, is_round, thesis=0.05, goal=0.005),
    Claim("42", "cylinder", CLOSEST_RANGE, is_round, "sd"),
    Claim("", "cylinder", RADIUS, is_round, to_mm=500, goal=0.05),
)


@dataclass(frozen=True)
class Row:
    """One row of the comparison."""

    figure: str
    target: str
    quantity: str
    unit: str
    """`%` of a relative error, else that of the quantity; empty for a ratio."""
    to_mm: float | None
    """Farthest range; None: all."""
    thesis: float | None
    ours: float | None
    """None: no reading of this kind has the quantity."""
    goal: float | None
    at_mm: float | None = None
    """Range of the largest value."""
    expanded: float | None = None
    """Expanded uncertainty U (k = 2) of the error at `at_mm`, relative."""
    readings: int = 0
    """Number of readings with the quantity."""
    missing: int = 0
    """Number of readings without the quantity."""
    lacking_mm: tuple[float, ...] = ()
    """True ranges of the placements where no reading has the quantity."""
    cause: Cause | None = None
    """Cause of the error besides noise and calibration; None: none is known."""
    cause_size: float | None = None
    """Computed size of the cause at `at_mm`, relative; None: not known."""

    @property
    def ratio(self) -> float | None:
        """Ours / thesis."""
        return None if self.thesis is None or self.ours is None else self.ours / self.thesis

    @property
    def is_reached(self) -> bool | None:
        """Whether the goal is reached at every placement; None without a goal."""
        return None if self.goal is None else self.complete is not None and self.complete <= self.goal

    @property
    def complete(self) -> float | None:
        """`ours`, or None where a placement lacks the quantity: its value there is not known."""
        return None if self.lacking_mm else self.ours


def compare(readings: Sequence[ReadingTaken], rig: Rig) -> list[Row]:
    """Rows of every claim, and of the errors with lasers left off relative to those of all lasers."""
    return [*(_row(claim, readings, rig) for claim in CLAIMS), *(_missing_row(n, readings) for n in (1, 3))]


def comparison_results(rows: Sequence[Row]) -> list[Result]:
    """Quantities of the rows with readings, for limits; a row whose readings lack the quantity fails them."""
    found, seen = [], [row for row in rows if row.ours is not None or row.missing]
    for row in seen:
        of = " ".join(
            part for part in (row.target, row.quantity, row.to_mm and f"to {row.to_mm:g} mm") if part
        )
        for quantity, reference in (("goal_ratio", row.goal), ("thesis_ratio", row.thesis)):
            if reference is not None:
                found.append(Result(quantity, of, None if row.complete is None else row.complete / reference))
    missed = sum(row.is_reached is False for row in seen)
    return [*found, Result("goals_missed", f"{len(seen)} rows", float(missed) if seen else None)]


def _row(claim: Claim, readings: Sequence[ReadingTaken], rig: Rig) -> Row:
    groups = by_placement(readings, claim.select, claim.to_mm)
    rated = [(group, claim.quantity.statistics(group)) for group in groups]
    found, lacking_mm = [], []
    for group, statistics in rated:
        ours, true = _value(claim, group, statistics), claim.quantity.true(group[0])
        if ours is None or true is None:
            lacking_mm.append(group[0].reference_mm)
        else:
            found.append((ours, group, statistics.expanded, abs(true)))
    row = Row(
        claim.figure,
        claim.target,
        f"{claim.quantity.name} {claim.measure}",
        claim.quantity.unit if claim.measure == "sd" else "%",
        None if claim.to_mm == inf else claim.to_mm,
        claim.thesis,
        None,
        claim.goal,
        readings=sum(statistics.n for _, statistics in rated),
        missing=sum(statistics.missing for _, statistics in rated),
        lacking_mm=tuple(lacking_mm),
        cause=claim.cause,
    )
    if not found:
        return row
    ours, group, expanded, true = max(found, key=lambda one: one[0])
    size = None if claim.cause is None else claim.cause.size(group, rig)
    return replace(
        row,
        ours=ours,
        at_mm=group[0].reference_mm,
        expanded=None if expanded is None else expanded / true,
        cause_size=None if size is None else size / true,
    )


def _value(claim: Claim, group: Sequence[ReadingTaken], statistics: ErrorStatistics) -> float | None:
    """Value of a claim at one placement; None if too few readings have the quantity."""
    if claim.measure == "sd":
        return statistics.sd
    true = claim.quantity.true(group[0])
    return None if true is None else _mean_error(statistics, true)


def _missing_row(left_off: int, readings: Sequence[ReadingTaken]) -> Row:
    """Mean error with lasers left off relative to that of all lasers, over the placements with both."""
    without = {place(g[0]): g for g in by_placement(readings, is_without(left_off), inf)}
    full = {place(g[0]): g for g in by_placement(readings, is_without(0), inf)}
    both = [key for key in without if key in full]
    errors = [(key[0], _relative(without[key]), _relative(full[key])) for key in both]
    pairs = [(own, whole) for _, own, whole in errors if own is not None and whole is not None]
    whole_error = fmean(whole for _, whole in pairs) if pairs else 0.0
    ours = fmean(own for own, _ in pairs) / whole_error if whole_error else None
    statistics = [CLOSEST_RANGE.statistics(without[key]) for key in both]
    return Row(
        "",
        f"{left_off} off",
        "error / that of all",
        "",
        None,
        None,
        ours,
        RATIO_GOAL,
        readings=sum(one.n for one in statistics),
        missing=sum(one.missing for one in statistics),
        lacking_mm=tuple(mm for mm, own, whole in errors if own is None or whole is None),
    )


def _relative(group: Sequence[ReadingTaken]) -> float | None:
    return _mean_error(CLOSEST_RANGE.statistics(group), group[0].reference_mm)


def _mean_error(statistics: ErrorStatistics, true: float) -> float | None:
    return None if statistics.mean_absolute is None else statistics.mean_absolute / abs(true)
