"""Statistics of the incline trial: errors of range and angle, and of differences of set angles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from math import hypot, sqrt
from statistics import fmean

import numpy as np
from scipy.stats import chi2

from workbench.model.event import ReadingTaken
from workbench.trials.errors import EXPANSION, ErrorStatistics, error_statistics, range_statistics
from workbench.trials.statistics.line import fit_line
from workbench.trials.targets import InclineSpec

FEWEST_ANGLES = 3
"""Smallest number of set angles through which a line is fitted."""


@dataclass(frozen=True)
class InclineRow:
    """Statistics of one set-up."""

    target: InclineSpec
    asked_mm: float
    """Closest range asked for, common to the set-ups that are compared; the true one is as measured."""
    true_mm: float
    range: ErrorStatistics
    """mm"""
    angle: ErrorStatistics
    """deg"""
    angle_sd_deg: float | None
    """Stated standard uncertainty of an angle (root mean square); None without an angle."""
    reference_sd_deg: float
    """Reference uncertainty of the set angle, with the tilt common to all placements."""
    true_deg: float
    """Set angle, with the tilt common to all placements as measured."""


@dataclass(frozen=True)
class AngleDifference:
    """Difference of two measured angles - that of the set ones; a tilt common to both cancels."""

    asked_mm: float
    angles_deg: tuple[float, float]
    error_deg: float
    expanded_deg: float
    """Expanded uncertainty U (k = 2), with the sensor's errors at both angles taken as independent. It is too
    large where the calibration turns both alike, too small where it turns them against each other."""


@dataclass(frozen=True)
class AngleLine:
    """Line measured = intercept + slope x set angle, at one closest range about one axis; 1 sigma."""

    axis: str
    asked_mm: float
    angles: int
    slope: float
    slope_sd: float
    intercept_deg: float
    """Measured angle of a target set square: the tilt common to all placements, and the sensor's own."""
    intercept_sd_deg: float
    probability: float
    """P value of the deviations from the line."""


def angle_lines(rows: Sequence[InclineRow]) -> list[AngleLine]:
    """Lines through three angles or more at one range about one axis, with errors in both coordinates."""
    groups: dict[tuple[str, float], list[InclineRow]] = {}
    for row in rows:
        if row.angle.mean is not None and row.angle_sd_deg:
            groups.setdefault((row.target.axis, row.asked_mm), []).append(row)
    return [_line(*key, of) for key, of in groups.items() if len(of) >= FEWEST_ANGLES]


def _line(axis: str, asked_mm: float, rows: Sequence[InclineRow]) -> AngleLine:
    found = fit_line(
        np.array([row.true_deg for row in rows]),
        np.array([row.true_deg + (row.angle.mean or 0.0) for row in rows]),
        np.array([row.target.reference_sd_deg for row in rows]),
        np.array([row.angle_sd_deg for row in rows], np.float64),
    )
    slope_sd, intercept_sd_deg = np.sqrt(np.diag(found.covariance)).tolist()
    p = float(chi2.sf(found.chi2, found.degrees_of_freedom))
    return AngleLine(axis, asked_mm, len(rows), found.slope, slope_sd, found.intercept, intercept_sd_deg, p)


def incline_row(target: InclineSpec, asked_mm: float, readings: Sequence[ReadingTaken]) -> InclineRow:
    """Statistics of the readings at one set-up, at least one."""
    angle_deg = true_angle_deg(target, readings[0])
    errors = [None if r.angle_deg is None else r.angle_deg - angle_deg for r in readings]
    stated = [r.angle_sd_deg for r in readings if r.angle_sd_deg is not None]
    return InclineRow(
        target,
        asked_mm,
        readings[0].reference_mm,
        range_statistics(readings),
        error_statistics(errors, stated, _reference_sd_deg(target, readings[0])),
        sqrt(fmean(sd**2 for sd in stated)) if stated else None,
        _reference_sd_deg(target, readings[0]),
        angle_deg,
    )


def true_angle_deg(target: InclineSpec, reading: ReadingTaken) -> float:
    """True angle of a reading."""
    stated = None if reading.true is None else reading.true.angle_deg
    return target.angle_deg if stated is None else stated


def _reference_sd_deg(target: InclineSpec, reading: ReadingTaken) -> float:
    """Reference uncertainty of a set angle, with the tilt common to all placements."""
    stated = None if reading.true is None else reading.true.angle_sd_deg
    return target.reference_sd_deg if stated is None else stated


def angle_differences(rows: Sequence[InclineRow]) -> list[AngleDifference]:
    """Differences of every two set angles about the same axis at the same closest range."""
    found = []
    for first, second in combinations(rows, 2):
        if (first.asked_mm, first.target.axis) != (second.asked_mm, second.target.axis):
            continue
        if first.angle.mean is None or second.angle.mean is None:
            continue
        u_deg = hypot(
            first.angle_sd_deg or 0.0,
            second.angle_sd_deg or 0.0,
            first.target.reference_sd_deg,
            second.target.reference_sd_deg,
        )
        found.append(
            AngleDifference(
                first.asked_mm,
                (first.target.angle_deg, second.target.angle_deg),
                second.angle.mean - first.angle.mean,
                EXPANSION * u_deg,
            )
        )
    return found
