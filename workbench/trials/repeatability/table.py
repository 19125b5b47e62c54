"""Table and chart of repeatability and reproducibility, for readings of any origin."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from workbench.model.chart import Axis, Band, Chart, Series
from workbench.model.table import Cell, Column, Table
from workbench.trials.reading_frame import dependence, levels, table_of
from workbench.trials.statistics.autocorrelation import Autocorrelation
from workbench.trials.statistics.estimate import TooFewReadingsError
from workbench.trials.statistics.repeatability import (
    LIMIT_FACTOR,
    OutlierTest,
    Repeatability,
    cochran,
    grubbs,
    repeatability,
    repeatability_alone,
)
from workbench.trials.statistics.resolution import coarse_step

OUTLIER_PROBABILITY = 0.01
"""A placement is reported as an outlier below this probability (ISO 5725-2, section 7.3)."""
COLUMNS = (
    Column(key="standoff_mm", name="true", unit="mm"),
    Column(key="readings", name="n"),
    Column(key="missing", name="missing"),
    Column(key="placements", name="placements"),
    Column(key="sessions", name="sessions"),
    Column(key="repeatability_sd_mm", name="s_r", unit="mm", format="sd"),
    Column(key="repeatability_low_mm", name="low", unit="mm", format="sd"),
    Column(key="repeatability_high_mm", name="high", unit="mm", format="sd"),
    Column(key="placement_sd_mm", name="s_L", unit="mm", format="sd"),
    Column(key="session_sd_mm", name="sessions sd", unit="mm", format="sd"),
    Column(key="reproducibility_sd_mm", name="s_R", unit="mm", format="sd"),
    Column(key="reproducibility_low_mm", name="low", unit="mm", format="sd"),
    Column(key="reproducibility_high_mm", name="high", unit="mm", format="sd"),
    Column(key="repeatability_limit_mm", name="r", unit="mm", format="sd"),
    Column(key="reproducibility_limit_mm", name="R", unit="mm", format="sd"),
    Column(key="cochran_p", name="Cochran p", format=".2g"),
    Column(key="grubbs_p", name="Grubbs p", format=".2g"),
    Column(key="note", name="note"),
)
CAPTION = (
    "s_r: repeats at one placement; s_L: between placements; s_R: all; low, high: 95 % intervals; r, R: 95 %"
    " limits of the difference of two readings"
)


def precision_table(name: str, frame: pd.DataFrame) -> Table:
    """Table of repeatability and reproducibility, one row per standoff.

    Args:
        name: name of the table.
        frame: readings, see `reading_frame.COLUMNS`; those without a range count as missing.
    """
    repeats = dependence(frame)
    rows = [_row(standoff_mm, readings, repeats) for standoff_mm, readings in levels(frame)]
    return table_of(name, "Repeatability and reproducibility (ISO 5725-2)", COLUMNS, rows, CAPTION)


def _row(standoff_mm: float, readings: pd.DataFrame, repeats: Autocorrelation) -> dict[str, Cell]:
    used = readings.dropna(subset=["error_mm"])
    cell = used["session"].astype(str) + "/" + used["placement"].astype(str)
    row: dict[str, Cell] = {
        "standoff_mm": standoff_mm,
        "readings": len(used),
        "missing": len(readings) - len(used),
        "placements": cell.nunique(),
        "sessions": used["session"].nunique(),
    }
    notes = [f"repeats autocorrelated ({repeats.lag1:.2f}), intervals widened"] if repeats.lag1 > 0 else []
    try:
        found = repeatability(used, repeats)
    except TooFewReadingsError as error:
        return row | _repeats_alone(used, repeats, notes, f"{error} (column placement)")
    if (step_mm := coarse_step(used)) is not None:
        notes.append(f"resolution {step_mm:.3g} mm: too coarse for tests of outliers")
        return row | _precision(found) | {"note": "; ".join(notes)}
    tests: dict[str, Cell] = {}
    for key, test in _outlier_tests(used.assign(placement=cell)):
        tests[key] = test.probability
        if test.probability < OUTLIER_PROBABILITY:
            notes.append(f"placement {test.group}: outlier ({key.removesuffix('_p').capitalize()})")
    return row | _precision(found) | tests | {"note": "; ".join(notes)}


def _repeats_alone(
    used: pd.DataFrame, repeats: Autocorrelation, notes: Sequence[str], why: str
) -> dict[str, Cell]:
    """Cells of s_r where s_R has no estimate, for the reason `why`."""
    try:
        alone = repeatability_alone(used, repeats)
    except TooFewReadingsError as error:
        return {"note": f"no statistics: {error}"}
    return {
        "repeatability_sd_mm": alone.value,
        "repeatability_low_mm": alone.low,
        "repeatability_high_mm": alone.high,
        "repeatability_limit_mm": LIMIT_FACTOR * alone.value,
        "note": "; ".join([f"no s_R: {why}", *notes]),
    }


def _outlier_tests(used: pd.DataFrame) -> Iterator[tuple[str, OutlierTest]]:
    """Tests that the number of placements allows, by column."""
    try:
        yield "cochran_p", cochran(used)
        yield "grubbs_p", grubbs(used.groupby("placement")["error_mm"].mean())
    except TooFewReadingsError:
        return


def _precision(found: Repeatability) -> dict[str, Cell]:
    return {
        "repeatability_sd_mm": found.repeatability.value,
        "repeatability_low_mm": found.repeatability.low,
        "repeatability_high_mm": found.repeatability.high,
        "placement_sd_mm": found.between_placements,
        "session_sd_mm": found.between_sessions,
        "reproducibility_sd_mm": found.reproducibility.value,
        "reproducibility_low_mm": found.reproducibility.low,
        "reproducibility_high_mm": found.reproducibility.high,
        "repeatability_limit_mm": found.repeatability_limit,
        "reproducibility_limit_mm": found.reproducibility_limit,
    }


def precision_chart(name: str, table: Table) -> Chart:
    """Chart of s_r and s_R over the standoff, with the 95 % interval of s_R.

    Args:
        name: name of the chart.
        table: result of `precision_table`.
    """
    rows = [row for row in table.records() if row["reproducibility_sd_mm"] is not None]

    def values(key: str) -> tuple[float, ...]:
        return tuple(np.array([row[key] for row in rows], np.float64).tolist())

    x = values("standoff_mm")
    return Chart(
        name=name,
        title="Repeatability and reproducibility, band: 95 % interval of s_R",
        x=Axis(label="standoff", unit="mm", scale="log"),
        y=Axis(label="standard deviation", unit="mm"),
        series=(
            Series(name="s_r", x=x, y=values("repeatability_sd_mm"), style="line"),
            Series(name="s_R", x=x, y=values("reproducibility_sd_mm"), style="line"),
        ),
        bands=(
            Band(
                name="s_R, 95 %",
                x=x,
                low=values("reproducibility_low_mm"),
                high=values("reproducibility_high_mm"),
            ),
        ),
    )
