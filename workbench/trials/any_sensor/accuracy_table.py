"""Table of the errors of readings at each true range, with an interval that counts placements."""

from __future__ import annotations

import numpy as np
import pandas as pd

from workbench.model.table import Cell, Column, Table
from workbench.trials.errors import ErrorSpread
from workbench.trials.reading_frame import dependence, levels, table_of
from workbench.trials.statistics.autocorrelation import Autocorrelation, standard_error
from workbench.trials.statistics.estimate import mean_estimate

COLUMNS = (
    Column(key="standoff_mm", name="true", unit="mm"),
    Column(key="readings", name="n"),
    Column(key="missing", name="missing"),
    Column(key="placements", name="placements"),
    Column(key="sessions", name="sessions"),
    Column(key="mean_error_mm", name="mean error", unit="mm", format="+.3g"),
    Column(key="mean_low_mm", name="low", unit="mm", format="+.3g"),
    Column(key="mean_high_mm", name="high", unit="mm", format="+.3g"),
    Column(key="max_error_mm", name="max", unit="mm", format="+.3g"),
    Column(key="min_error_mm", name="min", unit="mm", format="+.3g"),
    Column(key="sd_mm", name="sd", unit="mm", format="sd"),
    Column(key="mean_se_mm", name="se of mean", unit="mm", format="sd"),
    Column(key="mean_relative_error", name="mean error", unit="%", scale=100, format="+.2f"),
    Column(key="note", name="note"),
)
CAPTION = (
    "mean error: mean over placements, with several sessions over sessions; low, high: its 95 % interval over"
    " these (Student); se of mean: standard error, at one placement only that of its repeats"
)


def accuracy_table(name: str, frame: pd.DataFrame) -> Table:
    """Table of the errors, measured - true, one row per true range.

    Args:
        name: name of the table.
        frame: readings, see `reading_frame.COLUMNS`; those without a range count as missing.
    """
    repeats = dependence(frame)
    rows = [_row(standoff_mm, readings, repeats) for standoff_mm, readings in levels(frame)]
    return table_of(name, "Accuracy: error = measured - true", COLUMNS, rows, CAPTION)


def _row(standoff_mm: float, readings: pd.DataFrame, repeats: Autocorrelation) -> dict[str, Cell]:
    used = readings.dropna(subset=["error_mm"]).sort_values("repeat", kind="stable")
    error = used["error_mm"].to_numpy(np.float64)
    by_placement = used.groupby(["session", "placement"])["error_mm"].mean()
    by_session = by_placement.groupby("session").mean()
    # Placements of one session share its error: with several, sessions are the independent values.
    means = (by_session if len(by_session) > 1 else by_placement).to_numpy(np.float64)
    row: dict[str, Cell] = {
        "standoff_mm": standoff_mm,
        "readings": len(error),
        "missing": len(readings) - len(error),
        "placements": len(by_placement),
        "sessions": len(by_session),
    }
    if not len(error):
        return row | {"note": "no statistics: no reading has a range"}
    mean, spread = float(means.mean()), ErrorSpread.of(error)
    row |= {
        "mean_error_mm": mean,
        "max_error_mm": spread.largest,
        "min_error_mm": spread.smallest,
        "sd_mm": spread.sd,
        "mean_relative_error": mean / standoff_mm if standoff_mm else None,
    }
    if len(means) > 1:
        found = mean_estimate(means)
        se = float(means.std(ddof=1) / np.sqrt(len(means)))
        return row | {"mean_low_mm": found.low, "mean_high_mm": found.high, "mean_se_mm": se, "note": ""}
    if len(error) == 1:
        return row | {"note": "one reading: no scatter, no interval"}
    widened = f"; repeats autocorrelated ({repeats.lag1:.2f}), se widened" if repeats.lag1 > 0 else ""
    return row | {
        "mean_se_mm": standard_error(error, repeats),
        "note": f"one placement: no interval of the mean error{widened}",
    }
