"""Table and chart of a gauge R&R study, for readings of any origin."""

from __future__ import annotations

from math import isfinite

import numpy as np
import pandas as pd

from workbench.model.chart import Axis, Chart, Series
from workbench.model.errors import BadInputError
from workbench.model.number_text import probability
from workbench.model.table import Cell, Column, Table
from workbench.trials.reading_frame import table_of
from workbench.trials.statistics.estimate import Estimate
from workbench.trials.statistics.gauge_rr import GaugeStudy, gauge_rr

COLUMNS = (
    Column(key="component", name="component"),
    Column(key="sd_mm", name="sd", unit="mm", format="sd"),
    Column(key="low_mm", name="low", unit="mm", format="sd"),
    Column(key="high_mm", name="high", unit="mm", format="sd"),
    Column(key="study_variation", name="study variation", unit="%", scale=100, format=".1f"),
    Column(key="distinct_categories", name="ndc", format=".1f"),
    Column(key="note", name="note"),
)
TITLE = "Gauge R&R (AIAG): part = standoff, trial = placement"
DESIGN = "column session: operator; column placement: trial; true range: part"


def gauge_table(name: str, frame: pd.DataFrame) -> Table:
    """Table of the components of variance, one row each.

    A part is a requested standoff, an operator the column `session`, a trial a placement, with the mean of
    its readings. A target beside its standoff counts by its error from the true range.

    Args:
        name: name of the table.
        frame: readings, see `reading_frame.COLUMNS`; those without a range are left out.
    """
    used = frame.dropna(subset=["error_mm"])
    keys = ["standoff_mm", "session", "placement"]
    trials = used.groupby(keys, as_index=False)["error_mm"].mean()
    trials = trials.assign(
        part=trials["standoff_mm"],
        operator=trials["session"].astype(str),
        measured_mm=trials["standoff_mm"] + trials["error_mm"],
    )
    try:
        study = gauge_rr(trials)
    except BadInputError as error:
        row: dict[str, Cell] = {"component": "GRR", "note": f"no statistics: {error} ({DESIGN})"}
        return table_of(name, TITLE, COLUMNS, [row], "")
    caption = (
        f"{study.parts} standoffs, {study.operators} operators, {study.trials} trials of each;"
        f" readings a trial: {len(used) / len(trials):.3g}; low, high: 95 % interval; ndc: distinct"
        " categories; PV, study variation and ndc follow from the choice of standoffs"
    )
    return table_of(name, TITLE, COLUMNS, _rows(study), caption)


def _rows(study: GaugeStudy) -> list[dict[str, Cell]]:
    categories = study.distinct_categories
    pooled = f"pooled with EV ({probability(study.interaction_probability)})"
    rows: list[dict[str, Cell]] = [
        {"component": "EV (repeatability)", **_sd_cells(study, study.equipment)},
        {"component": "AV (operators)", "sd_mm": study.appraiser},
        {
            "component": "interaction",
            "sd_mm": study.interaction,
            "note": pooled if study.interaction is None else probability(study.interaction_probability),
        },
        {
            "component": "GRR",
            **_sd_cells(study, study.gauge),
            "distinct_categories": categories if isfinite(categories) else None,
        },
        {"component": "PV (standoffs)", "sd_mm": study.part},
        {"component": "TV", "sd_mm": study.total},
    ]
    for row in rows:
        row.setdefault("note", "")
        sd = row["sd_mm"]
        if isinstance(sd, float) and study.total > 0:
            row["study_variation"] = sd / study.total
    return rows


def _sd_cells(study: GaugeStudy, found: Estimate) -> dict[str, Cell]:
    """Standard deviation, its interval if it holds, and its degrees of freedom or why there is none."""
    if study.has_intervals:
        note = f"{found.degrees_of_freedom:.3g} degrees of freedom"
        return {"sd_mm": found.value, "low_mm": found.low, "high_mm": found.high, "note": note}
    p = study.homogeneity_probability
    note = f"no interval: repeatability differs between standoffs or operators ({probability(p)})"
    return {"sd_mm": found.value, "note": note}


def gauge_chart(name: str, frame: pd.DataFrame) -> Chart:
    """Chart of the errors over the standoff, one series for each operator.

    Args:
        name: name of the chart.
        frame: readings, see `reading_frame.COLUMNS`.
    """
    used = frame.dropna(subset=["error_mm"])
    return Chart(
        name=name,
        title="Errors by operator",
        x=Axis(label="standoff", unit="mm", scale="log"),
        y=Axis(label="error", unit="mm"),
        series=tuple(
            Series(
                name=str(operator),
                x=tuple(readings["standoff_mm"].to_numpy(np.float64).tolist()),
                y=tuple(readings["error_mm"].to_numpy(np.float64).tolist()),
            )
            for operator, readings in used.groupby("session", sort=False)
        ),
    )
