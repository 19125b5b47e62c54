"""Control charts of a sensor's verifications, its drift, and the date at which to calibrate it again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta
from math import inf, sqrt

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.model.stats import norm_ppf, t_cdf
from workbench.model.trial_event import COVERAGE_FACTOR
from workbench.report.history.verifications import DistanceCheck, Verification, monitored_mm
from workbench.trials.statistics.control_chart import FALSE_ALARM, FIRST_SESSIONS, ControlChart, control_chart

DAY_NS = 86_400 * 10**9
LONGEST_DAYS = 3650
"""Longest time ahead for which a date is stated."""


@dataclass(frozen=True)
class Drift:
    """Deviation after an alarm, relative to the range."""

    amount: float
    since: str
    """Day of the first session of the deviation."""
    rule: str


@dataclass(frozen=True)
class Excess:
    """Mean error of a session beyond its stated uncertainty; relative to the range."""

    error: float
    expanded: float
    """U, 95 %."""
    day: str
    alarm: bool
    """Whether it is beyond U at the probability of a false alarm of the charts."""


@dataclass(frozen=True)
class DistanceHistory:
    """Chart of one distance; errors are relative to the range."""

    range_mm: float
    sessions: tuple[str, ...]
    """(n,) names of the sessions with this distance."""
    days: FloatArray
    """(n,) since the first session."""
    errors: FloatArray
    """(n,)"""
    scatter: FloatArray
    """(n,)"""
    chart: ControlChart | None
    """None: too few sessions."""
    drift: Drift | None
    """None: in control."""
    excess: Excess | None
    """First alarm, or else that of the last session; None: the errors are within U."""
    due: date | None
    """Day at which the trend reaches a control limit; None: no significant trend."""


def distance_histories(checked: Sequence[Verification]) -> tuple[DistanceHistory, ...]:
    """Charts at the monitored distances; they share the probability of a false alarm."""
    charted = [one for one in checked if one.checks]
    ranges = monitored_mm(charted)
    return tuple(_history(charted, mm, len(ranges)) for mm in ranges)


def _history(every: Sequence[Verification], range_mm: float, charts: int) -> DistanceHistory:
    pairs = [(one, check) for one in every if (check := one.at(range_mm)) is not None]
    errors = np.array([check.error for _, check in pairs])
    scatter = np.array([check.scatter for _, check in pairs])
    days = np.array([(one.time_ns - every[0].time_ns) / DAY_NS for one, _ in pairs])
    readings = np.array([check.readings for _, check in pairs])
    chart = control_chart(errors, scatter, readings, charts)
    return DistanceHistory(
        range_mm,
        tuple(one.session for one, _ in pairs),
        days,
        errors,
        scatter,
        chart,
        None if chart is None else _drift(chart, [one.day for one, _ in pairs]),
        _excess(pairs, charts),
        None if chart is None else _due(chart, days, every[0].time_ns, charts),
    )


def _drift(chart: ControlChart, days: Sequence[str]) -> Drift | None:
    if chart.alarm is None:
        return None
    amount = float(chart.values[chart.alarm.since :].mean()) - chart.limits.centre
    return Drift(amount, days[chart.alarm.since], chart.alarm.rule)


def _excess(pairs: Sequence[tuple[Verification, DistanceCheck]], charts: int) -> Excess | None:
    """Comparison of each session's mean error with U, about the centre 0: a constant error is seen too.

    U is 95 %; an alarm needs the error that a sound sensor exceeds with the charts' shared probability.
    """
    factor = -float(norm_ppf(FALSE_ALARM / charts / 2)) / COVERAGE_FACTOR
    alarms = [pair for pair in pairs if abs(pair[1].error) > factor * pair[1].expanded]
    session, check = alarms[0] if alarms else pairs[-1]
    if not abs(check.error) > check.expanded:
        return None
    return Excess(check.error, check.expanded, session.day, bool(alarms))


def _due(chart: ControlChart, days: FloatArray, first_ns: int, charts: int) -> date | None:
    """Day at which a straight line through the sessions leaves the control limits.

    The charts and all sessions at which the trend is tested share the probability of a false one, as the
    x-bar charts do.
    """
    if len(days) < FIRST_SESSIONS + 2 or np.ptp(days) <= 0:
        return None
    slope, level, p = _line(days, chart.values)
    if p > FALSE_ALARM / charts or slope == 0:
        return None
    edge = chart.limits.centre + np.sign(slope) * chart.limits.half_width
    at_days = (edge - level) / slope
    if not 0 <= at_days - days[-1] <= LONGEST_DAYS:
        return None if at_days > days[-1] else _day(first_ns, days[-1])
    return _day(first_ns, at_days)


def _line(x: FloatArray, y: FloatArray) -> tuple[float, float, float]:
    """Slope, level at x = 0 and p value of the slope of a least-squares line."""
    centred = x - x.mean()
    slope = float(centred @ y / (centred @ centred))
    level = float(y.mean() - slope * x.mean())
    rest = y - level - slope * x
    u = sqrt(float(rest @ rest) / (len(x) - 2) / float(centred @ centred))
    t = abs(slope) / u if u > 0 else inf
    return slope, level, 2.0 * float(t_cdf(-t, len(x) - 2))


def _day(first_ns: int, days: float) -> date:
    return (datetime.fromtimestamp(first_ns / 1e9, tz=UTC) + timedelta(days=float(days))).date()
