"""Section on the verifications of a sensor: x-bar, s and CUSUM chart of each distance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from workbench.model.chart import Axis, Chart, LimitLine, Series
from workbench.model.table import Column, Table
from workbench.report.document import Section
from workbench.report.history.drift import DistanceHistory
from workbench.report.history.verifications import Verification
from workbench.trials.statistics.control_chart import CUSUM_LIMIT, FIRST_SESSIONS

RULES = (
    f"Limits are frozen from the first {FIRST_SESSIONS} sessions with the calibration in force. An alarm is a"
    " session beyond the control limits, a CUSUM (reference 1 sd) above"
    f" {CUSUM_LIMIT:g} sd, or a scatter of the repeats above its limit. The charts of all distances together"
    " raise at most one false alarm in 370 sessions. Each session's mean error is also compared with its"
    " stated uncertainty U, about 0."
)


def verification_section(checked: Sequence[Verification], distances: Sequence[DistanceHistory]) -> Section:
    """Control charts of every distance, and the table of the sessions' mean errors."""
    several = [one for one in distances if len(one.days) > 1]
    charts = [chart for one in several for chart in _charts(one)]
    tables = tuple(table for table in (_table(checked, distances),) if table.rows)
    title = "Verifications: control charts"
    return Section("verifications", title, texts=(RULES,), tables=tables, charts=tuple(charts))


def _charts(one: DistanceHistory) -> list[Chart]:
    name = f"{one.range_mm:g}mm"
    day = Axis(label="days since the first verification", unit="d")
    errors = tuple((100 * one.errors).tolist())
    days = tuple(np.round(one.days).tolist())
    limits: tuple[LimitLine, ...] = ()
    if one.chart is not None:
        centre, half = 100 * one.chart.limits.centre, 100 * one.chart.limits.half_width
        limits = (
            LimitLine(name="centre", y=centre),
            LimitLine(name="control limits", y=centre + half),
            LimitLine(name="control limits", y=centre - half),
        )
    flagged = () if one.chart is None or one.chart.alarm is None else (days[one.chart.alarm.index],)
    charts = [
        Chart(
            name=f"xbar_{name}",
            title=f"Mean error at {one.range_mm:g} mm",
            x=day,
            y=Axis(label="error / range", unit="%"),
            series=(Series(name="session", x=days, y=errors),),
            limits=limits,
            flagged_x=flagged,
        )
    ]
    if one.chart is None:
        return charts
    later = days[FIRST_SESSIONS:]
    charts.append(
        Chart(
            name=f"cusum_{name}",
            title=f"CUSUM at {one.range_mm:g} mm",
            x=day,
            y=Axis(label="CUSUM", unit="sd"),
            series=(
                Series(name="upwards", x=later, y=tuple(one.chart.high.tolist()), style="line"),
                Series(name="downwards", x=later, y=tuple((-one.chart.low).tolist()), style="line"),
            ),
            limits=(LimitLine(name="limit", y=CUSUM_LIMIT), LimitLine(name="limit", y=-CUSUM_LIMIT)),
            flagged_x=flagged,
        )
    )
    limited = np.isfinite(one.chart.most_scatter)
    if limited.any():
        at = tuple(np.round(one.days[limited]).tolist())
        scatter, most = 100 * one.scatter[limited], 100 * one.chart.most_scatter[limited]
        charts.append(
            Chart(
                name=f"s_{name}",
                title=f"Scatter of the repeats at {one.range_mm:g} mm",
                x=day,
                y=Axis(label="s / range", unit="%"),
                series=(
                    Series(name="session", x=at, y=tuple(scatter.tolist())),
                    Series(name="limit", x=at, y=tuple(most.tolist()), style="line"),
                ),
            )
        )
    return [chart for chart in charts if not chart.is_empty]


def _table(checked: Sequence[Verification], distances: Sequence[DistanceHistory]) -> Table:
    ranges = [one.range_mm for one in distances]
    return Table(
        name="verifications",
        title="Mean error of each session, of the range",
        columns=(
            Column(key="session", name="session"),
            Column(key="day", name="day"),
            *(
                Column(key=f"error.{mm:g}", name=f"at {mm:g} mm", unit="%", scale=100, format="+.3f")
                for mm in ranges
            ),
        ),
        rows=tuple(
            (one.session, one.day, *(check.error if (check := one.at(mm)) else None for mm in ranges))
            for one in checked
            if any(one.at(mm) for mm in ranges)
        ),
    )
