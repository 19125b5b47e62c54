"""Control charts of a check standard: Shewhart x-bar and s, CUSUM; limits frozen from the first k sessions.

One value and one standard deviation per session; the value is the mean of the session's readings. A sensor
has several charts, one for each distance. The limits are for all charts of a sensor together: at most one
false alarm in 370 sessions. A drift of 0.25 standard deviations a session is found before it has grown to 3,
also if it is in one chart alone; the test of this module measures both.

Sources: Montgomery, Introduction to Statistical Quality Control, 6.3, 9.1; NIST/SEMATECH e-Handbook, 6.3.2.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Literal

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray, IndexArray
from workbench.model.stats import f_ppf, t_ppf

FIRST_SESSIONS = 10
"""Number k of first sessions that limits are frozen from."""
CUSUM_REFERENCE = 1.0
"""Deviation that the CUSUM lets pass at each session, in standard deviations.

Larger than the 0.5 for known limits: the error of a mean of k sessions would add up as if it were a drift.
"""
CUSUM_LIMIT = 8.0
"""Sum at which the CUSUM raises an alarm, in standard deviations."""
FALSE_ALARM = 1 / 3000
"""Probability of a false alarm of all x-bar charts at one session, and of all s charts."""
Rule = Literal["beyond the control limits", "CUSUM", "scatter of the repeats"]


@dataclass(frozen=True)
class Limits:
    """Limits of one chart."""

    centre: float
    """Mean of the first k sessions."""
    sd: float
    """Standard deviation between them."""
    half_width: float
    """Half width of the control limits of a session's value."""
    scatter: float
    """Pooled standard deviation of the repeats; NaN: the first k sessions have no repeats."""
    freedom: int
    """Its degrees of freedom."""
    tail: float
    """Probability that the repeats of a sound session scatter more than their limit."""

    def most_scatter(self, readings: IndexArray) -> FloatArray:
        """(n,) largest standard deviation of the readings of sessions with (n,) readings; NaN: no limit."""
        repeats = np.where(readings > 1, readings - 1.0, np.nan)
        freedom = self.freedom if self.scatter > 0 else np.nan
        limit: FloatArray = self.scatter * np.sqrt(f_ppf(1 - self.tail, repeats, freedom))
        return limit


@dataclass(frozen=True)
class Alarm:
    """First alarm of a chart."""

    index: int
    """Number of the session, from 0."""
    rule: Rule
    since: int
    """Session since which the deviation lasts: the first after the CUSUM was zero."""


@dataclass(frozen=True)
class ControlChart:
    """One chart with its alarm."""

    values: FloatArray
    """(n,)"""
    scatter: FloatArray
    """(n,) standard deviation of the repeats of each session; NaN: no repeats."""
    most_scatter: FloatArray
    """(n,) its limit by the session's number of readings; NaN: none."""
    limits: Limits
    high: FloatArray
    """(n - k,) CUSUM upwards, in standard deviations."""
    low: FloatArray
    """(n - k,) CUSUM downwards."""
    alarm: Alarm | None


def control_chart(
    values: FloatArray, scatter: FloatArray, readings: IndexArray, charts: int
) -> ControlChart | None:
    """Chart of the sessions in the order of time; None if there are too few for limits, or all are equal.

    Args:
        values: (n,) mean of each session.
        scatter: (n,) standard deviation of the readings of each session; NaN where there is one reading.
        readings: (n,) number of readings of each session.
        charts: number of charts of the sensor, which share the probability of a false alarm.
    """
    k = FIRST_SESSIONS
    if len(values) < k or not np.std(values[:k], ddof=1) > 0:
        return None
    limits = frozen_limits(values[:k], scatter[:k], readings[:k], charts)
    z = (values[k:] - limits.centre) / limits.sd
    high, low = cusum(z, CUSUM_REFERENCE), cusum(-z, CUSUM_REFERENCE)
    most = limits.most_scatter(readings)
    alarm = _first_alarm(values, scatter > most, limits, high, low)
    return ControlChart(values, scatter, most, limits, high, low, alarm)


def frozen_limits(first: FloatArray, scatter: FloatArray, readings: IndexArray, charts: int) -> Limits:
    """Limits from the first k sessions; a new value has Student's distribution about their mean.

    Args: as `control_chart`, of the first k sessions.
    """
    k, tail = len(first), FALSE_ALARM / charts
    sd = float(np.std(first, ddof=1))
    half_width = float(t_ppf(1 - tail / 2, k - 1)) * sd * sqrt(1 + 1 / k)
    repeated = readings > 1
    each = readings[repeated] - 1
    freedom = int(each.sum())
    pooled = sqrt(float(each @ scatter[repeated] ** 2) / freedom) if freedom else float("nan")
    return Limits(float(first.mean()), sd, half_width, pooled, freedom, tail)


def cusum(z: FloatArray, reference: float) -> FloatArray:
    """(n,) one-sided cumulative sum of deviations (n,) above a reference value, never below zero."""
    sums = np.zeros(len(z))
    total = 0.0
    for n, deviation in enumerate(z.tolist()):
        total = max(0.0, total + deviation - reference)
        sums[n] = total
    return sums


def _first_alarm(
    values: FloatArray, rough: BoolArray, limits: Limits, high: FloatArray, low: FloatArray
) -> Alarm | None:
    k = FIRST_SESSIONS
    for n in range(len(high)):
        since = k + _start(high if high[n] >= low[n] else low, n)
        if high[n] > CUSUM_LIMIT or low[n] > CUSUM_LIMIT:
            return Alarm(k + n, "CUSUM", since)
        if abs(values[k + n] - limits.centre) > limits.half_width:
            return Alarm(k + n, "beyond the control limits", since)
        if rough[k + n]:
            return Alarm(k + n, "scatter of the repeats", k + n)
    return None


def _start(sums: FloatArray, end: int) -> int:
    """Index of the first session of the run of positive sums that ends at `end`."""
    zeros = np.flatnonzero(sums[: end + 1] == 0)
    return min(int(zeros[-1]) + 1, end) if len(zeros) else 0
