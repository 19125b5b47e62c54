"""Results of drives as tables, charts and limits."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import hypot, inf, isfinite

import numpy as np
import pandas as pd

from workbench.model.chart import Axis, Chart, LimitLine, Series
from workbench.model.prior import LARGEST
from workbench.model.table import Cell, Column, Table
from workbench.model.trial_event import COVERAGE_FACTOR
from workbench.trials.drive.outcome import NEAREST, SENSORS, SONAR, DriveRecord, Outcome, StepRecord
from workbench.trials.drive.step import DriveStep
from workbench.trials.limits import Result
from workbench.trials.statistics.bootstrap import grouped_mean
from workbench.trials.statistics.coverage import clopper_pearson

PERCENT = 100.0
ENDS_MM = (0.0, 200.0, 500.0, 1000.0, 2000.0, 4000.0, inf)
"""Ends of the classes of true range."""
ON_FACE, AT_EDGE = "laser on a face", "laser at an edge"
ONE_BODY, BODIES = "closest, one body", "closest, several"


@dataclass(frozen=True)
class RangeError:
    """Error of one answer."""

    quantity: str
    drive: str
    true_mm: float
    error_mm: float
    inside: bool | None
    """Whether the true range lies in the stated 95 % interval; None: none is stated."""


def range_errors(drives: Sequence[DriveRecord]) -> Iterator[RangeError]:
    """Errors of all answers: of each laser, of the closest range over the front, of the sonar's clearance."""
    for drive in drives:
        for one in drive.steps:
            for laser in one.reading.lasers:
                truth = one.truth.lasers[laser.laser_id]
                if isfinite(truth.range_mm):
                    half_mm = COVERAGE_FACTOR * hypot(laser.sigma_mm, truth.sd_mm)
                    inside: bool | None = abs(laser.range_mm - truth.range_mm) <= half_mm
                    quantity = AT_EDGE if truth.at_edge else ON_FACE
                    error_mm = laser.range_mm - truth.range_mm
                    yield RangeError(quantity, drive.name, truth.range_mm, error_mm, inside)
            reading = one.reading
            if reading.range_mm is not None and isfinite(one.truth.front_mm):
                error_mm = reading.range_mm - one.truth.front_mm
                quantity = ONE_BODY if one.truth.front_is_one else BODIES
                inside = None if reading.interval_mm is None else not reading.is_outside
                yield RangeError(quantity, drive.name, one.truth.front_mm, error_mm, inside)
            if one.sonar_mm is not None and isfinite(one.clearance_mm):
                yield RangeError(SONAR, drive.name, one.clearance_mm, one.sonar_mm - one.clearance_mm, None)


def result_tables(name: str, drives: Sequence[DriveRecord], step: DriveStep) -> list[Table]:
    """Tables of the drives, of all drives together, and of errors by range."""
    return [
        drive_table(name, drives),
        summary_table(name, drives, step),
        error_table(name, list(range_errors(drives))),
    ]


def drive_table(name: str, drives: Sequence[DriveRecord]) -> Table:
    """Table of the outcomes, one row for each drive and sensor."""
    rows = [
        (
            drive.name,
            drive.obstacle or None,
            ("yes" if drive.is_met else "no") if drive.obstacle else None,
            one.sensor,
            one.stop_mm,
            one.rest_mm if isfinite(one.rest_mm) else None,
            one.missed,
            one.false_stop,
        )
        for drive in drives
        for one in drive.outcomes
    ]
    return Table(
        name=f"{name}-drives",
        title="Drives",
        columns=(
            Column(key="drive", name="drive"),
            Column(key="obstacle", name="towards"),
            Column(key="met", name="met"),
            Column(key="sensor", name="sensor"),
            Column(key="stop_mm", name="stop at", unit="mm", format=".0f"),
            Column(key="rest_mm", name="at rest", unit="mm", format=".0f"),
            Column(key="missed", name="missed"),
            Column(key="false_stop", name="false stop"),
        ),
        rows=tuple(rows),
        caption="towards: body on the collision course; met: by a beam, in time; stop at: true clearance at"
        " the first answer that stops the vehicle; at rest: after braking",
    )


def summary_table(name: str, drives: Sequence[DriveRecord], step: DriveStep) -> Table:
    """Table of missed obstacles, false stops and the smallest clearance of each sensor."""
    rows: list[tuple[Cell, ...]] = []
    for sensor in SENSORS:
        outcomes = [(drive, one) for drive in drives for one in drive.outcomes if one.sensor == sensor]
        courses = [one for drive, one in outcomes if drive.obstacle]
        met = [one for drive, one in outcomes if drive.obstacle and drive.is_met]
        false_stops = sum(one.false_stop for _, one in outcomes)
        rows.append(
            (
                sensor,
                len(outcomes),
                len(courses),
                _missed(courses),
                len(met),
                _missed(met),
                clopper_pearson(_missed(met), len(met))[1] if met else None,
                false_stops,
                *(clopper_pearson(false_stops, len(outcomes)) if outcomes else (None, None)),
                min((one.rest_mm for one in met), default=None),
            )
        )
    return Table(
        name=f"{name}-summary",
        title="Missed obstacles and false stops",
        columns=(
            Column(key="sensor", name="sensor"),
            Column(key="drives", name="drives"),
            Column(key="courses", name="courses"),
            Column(key="missed", name="missed"),
            Column(key="met", name="met"),
            Column(key="missed_met", name="missed"),
            Column(key="missed_met_high", name="at most", unit="%", scale=PERCENT, format=".1f"),
            Column(key="false_stops", name="false stops"),
            Column(key="false_low", name="low", unit="%", scale=PERCENT, format=".1f"),
            Column(key="false_high", name="high", unit="%", scale=PERCENT, format=".1f"),
            Column(key="rest_mm", name="least at rest", unit="mm", format=".0f"),
        ),
        rows=tuple(rows),
        caption="courses: drives on a collision course; met: those whose obstacle a beam meets in time;"
        f" braking distance {step.brakes.distance_mm:.0f} mm at {step.brakes.speed_mm_s:g} mm/s; at most,"
        " low, high: 95 % intervals (Clopper-Pearson); least at rest: after braking, of the met ones",
    )


def error_table(name: str, errors: Sequence[RangeError]) -> Table:
    """Table of the relative errors by class of true range."""
    found: dict[tuple[str, int], list[RangeError]] = defaultdict(list)
    for one in errors:
        found[one.quantity, int(np.searchsorted(ENDS_MM, one.true_mm, side="right"))].append(one)
    rows = [
        _error_row(quantity, ENDS_MM[n - 1], found[quantity, n])
        for quantity in (ON_FACE, AT_EDGE, ONE_BODY, BODIES, SONAR)
        for n in range(1, len(ENDS_MM) + 1)
        if (quantity, n) in found
    ]
    percent = {"unit": "%", "scale": PERCENT}
    return Table(
        name=f"{name}-errors",
        title="Relative error by true range",
        columns=(
            Column(key="of", name="answer of"),
            Column(key="from_mm", name="from", unit="mm"),
            Column(key="n", name="n"),
            Column(key="mean", name="mean", format="+.2f", **percent),
            Column(key="mean_low", name="low", format="+.2f", **percent),
            Column(key="mean_high", name="high", format="+.2f", **percent),
            Column(key="median_abs", name="median abs", format=".2f", **percent),
            Column(key="largest", name="largest", format=".1f", **percent),
            Column(key="coverage", name="inside", format=".0f", **percent),
        ),
        rows=tuple(rows),
        caption="true range: of the laser's beam, of the front's nearest ray, of the way ahead for the sonar;"
        " low, high: 95 % interval of the mean over drives (bootstrap); inside: in the stated 95 % interval",
    )


def result_charts(name: str, drives: Sequence[DriveRecord]) -> list[Chart]:
    """Charts of the answers against the clearance, and of the errors of each laser on a face."""
    steps = [one for drive in drives for one in drive.steps]
    known = [one.clearance_mm for one in steps if isfinite(one.clearance_mm)]
    ends = (min(known), max(known)) if known else (1.0, 2.0)
    mm = {"unit": "mm", "scale": "log"}
    faces: dict[str, list[RangeError]] = defaultdict(list)
    for error in range_errors(drives):
        faces[error.quantity].append(error)
    shown = [ON_FACE, ONE_BODY]
    return [
        Chart(
            name=f"{name}-answers",
            title="Answers on the way",
            x=Axis(label="true clearance", **mm),
            y=Axis(label="answer", **mm),
            series=(
                Series(name="true", x=ends, y=ends, style="line"),
                *(_answers(sensor, steps) for sensor in SENSORS),
            ),
        ),
        Chart(
            name=f"{name}-errors",
            title="Relative error by range",
            x=Axis(label="true range", **mm),
            y=Axis(label="error", unit="%"),
            series=tuple(
                Series(
                    name=quantity,
                    x=tuple(one.true_mm for one in faces[quantity]),
                    y=tuple(PERCENT * one.error_mm / one.true_mm for one in faces[quantity]),
                )
                for quantity in shown
            ),
            limits=(LimitLine(name="5 %", y=5.0), LimitLine(name="-5 %", y=-5.0)),
        ),
    ]


def drive_results(drives: Sequence[DriveRecord]) -> list[Result]:
    """Results of the nearest spot over all drives, for limits."""
    of = [(drive, one) for drive in drives for one in drive.outcomes if one.sensor == NEAREST]
    return [
        Result("missed_met", "obstacles that a beam meets", sum(o.missed and d.is_met for d, o in of)),
        Result("missed", "all obstacles", sum(one.missed for _, one in of)),
        Result("false_stops", "all drives", sum(one.false_stop for _, one in of)),
    ]


def step_frame(
    drives: Sequence[DriveRecord], bodies: Sequence[str], laser_ids: Sequence[str]
) -> pd.DataFrame:
    """One row a step: pose, truth, and the answers of both sensors (docs/worlds.md)."""
    return pd.DataFrame([_step_row(drive, one, bodies, laser_ids) for drive in drives for one in drive.steps])


def _step_row(
    drive: DriveRecord, one: StepRecord, bodies: Sequence[str], laser_ids: Sequence[str]
) -> dict[str, object]:
    reading, free = one.reading, one.truth.clearance
    ranges = {laser.laser_id: laser for laser in reading.lasers}
    row: dict[str, object] = {
        "drive": drive.name,
        "step": one.number,
        "x_mm": one.pose.x_mm,
        "y_mm": one.pose.y_mm,
        "heading_deg": one.pose.heading_deg,
        "clearance_mm": free.distance_mm,
        "nearest_body": bodies[free.body] if free.body >= 0 else "",
        "true_front_mm": one.truth.front_mm,
        "closest_mm": reading.range_mm,
        "closest_low_mm": reading.low_mm,
        "closest_high_mm": reading.high_mm,
        "nearest_spot_mm": one.answers[NEAREST],
        "shape": reading.shape,
        "sonar_mm": one.sonar_mm,
        "exposure": one.exposure,
        "status": reading.cause or reading.status,
    }
    for i in laser_ids:
        truth, found = one.truth.lasers[i], ranges.get(i)
        row |= {
            f"{i}_true_mm": truth.range_mm,
            f"{i}_true_sd_mm": truth.sd_mm,
            f"{i}_body": bodies[truth.body] if truth.body >= 0 else "",
            f"{i}_at_edge": truth.at_edge,
            f"{i}_mm": None if found is None else found.range_mm,
            f"{i}_u_mm": None if found is None else found.sigma_mm,
        }
    return row


def _missed(outcomes: Sequence[Outcome]) -> int:
    return sum(one.missed for one in outcomes)


def _error_row(quantity: str, from_mm: float, errors: Sequence[RangeError]) -> tuple[Cell, ...]:
    relative = np.array([one.error_mm / one.true_mm for one in errors])
    names = np.array([one.drive for one in errors])
    groups = [relative[names == name] for name in dict.fromkeys(names.tolist())]
    interval = grouped_mean(groups) if len(groups) > 1 else None
    stated = [one.inside for one in errors if one.inside is not None]
    return (
        quantity,
        from_mm,
        len(errors),
        float(relative.mean()),
        None if interval is None else interval.low,
        None if interval is None else interval.high,
        float(np.median(np.abs(relative))),
        float(np.abs(relative).max()),
        float(np.mean(stated)) if stated else None,
    )


def _answers(sensor: str, steps: Sequence[StepRecord]) -> Series:
    points = [(one.clearance_mm, one.answers[sensor]) for one in steps]
    kept = [(x, y) for x, y in points if 0 < x < LARGEST and (y is None or y > 0)]
    return Series(name=sensor, x=tuple(x for x, _ in kept), y=tuple(y for _, y in kept))
