"""Error budget of re-placed readings: their observed variance compared with its stated sources."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from workbench.model.number_text import probability
from workbench.model.table import Cell, Column, Table
from workbench.model.trial_event import COVERAGE_FACTOR
from workbench.trials.reading_frame import dependence, levels, table_of
from workbench.trials.repeatability.step import JOINT_ALARM
from workbench.trials.statistics.autocorrelation import Autocorrelation
from workbench.trials.statistics.coverage import interval_coverage
from workbench.trials.statistics.error_budget import ErrorBudget, budget_test
from workbench.trials.statistics.estimate import TooFewReadingsError
from workbench.trials.statistics.repeatability import repeatability

COLUMNS = (
    Column(key="standoff_mm", name="true", unit="mm"),
    Column(key="observed_sd_mm", name="observed sd", unit="mm", format="sd"),
    Column(key="degrees_of_freedom", name="dof", format=".1f"),
    Column(key="spot_u_mm", name="spots u", unit="mm", format="sd"),
    Column(key="reference_u_mm", name="placement u", unit="mm", format="sd"),
    Column(key="explained_sd_mm", name="explained sd", unit="mm", format="sd"),
    Column(key="variance_ratio", name="variance ratio", format=".2f"),
    Column(key="unexplained_mm2", name="unexplained", unit="mm2", format="+sd"),
    Column(key="unexplained_low_mm2", name="low", unit="mm2", format="+sd"),
    Column(key="unexplained_high_mm2", name="high", unit="mm2", format="+sd"),
    Column(key="alarm", name="alarm"),
    Column(key="coverage", name="coverage", unit="%", scale=100, format=".0f"),
    Column(key="coverage_low", name="low", unit="%", scale=100, format=".0f"),
    Column(key="coverage_high", name="high", unit="%", scale=100, format=".0f"),
    Column(key="note", name="note"),
)
CAPTION = (
    "observed: as s_R, without truncation of negative components; explained: spots with speckle, and"
    " placement; alarm: variance left unexplained (low > 0); coverage of the stated 95 % intervals; low,"
    " high: 95 % intervals"
)


def budget_table(name: str, frame: pd.DataFrame) -> Table:
    """Table of the budget, one row per standoff, and one for all standoffs together.

    The errors of the calibration, of the ruler's scale and of the tilt common to all placements are common to
    all readings and no source of their variance.

    Args:
        name: name of the table.
        frame: readings, see `reading_frame.COLUMNS`, with their stated uncertainties.
    """
    repeats = dependence(frame)
    rows: list[dict[str, Cell]] = []
    budgets: list[ErrorBudget] = []
    for standoff_mm, readings in levels(frame):
        used = readings.dropna(subset=["error_mm"])
        row: dict[str, Cell] = {"standoff_mm": standoff_mm, "note": ""}
        try:
            budget = _budget(used, repeats)
        except TooFewReadingsError as error:
            row["note"] = f"no budget: {error}"
        else:
            budgets.append(budget)
            row |= _budget_cells(budget) | _coverage_cells(used)
        rows.append(row)
    return table_of(name, "Error budget", COLUMNS, [*rows, *_total(budgets)], CAPTION)


def _budget(used: pd.DataFrame, repeats: Autocorrelation) -> ErrorBudget:
    """Budget at one standoff.

    Raises:
        TooFewReadingsError: the readings have no precision, or an uncertainty is unknown.
    """
    found = repeatability(used, repeats)
    stated = used[["spot_u_mm", "placement_u_mm"]]
    if stated.isna().to_numpy().any():
        raise TooFewReadingsError("expected the uncertainties of spots and placements, got unknown ones")
    spot_mm, placement_mm = np.sqrt((stated**2).mean()).tolist()
    sources = {"spot_u_mm": spot_mm, "reference_u_mm": placement_mm}
    if not sum(sources.values()) > 0:
        raise TooFewReadingsError("expected stated uncertainties above 0 mm")
    return ErrorBudget(found.unbiased_variance, found.reproducibility.degrees_of_freedom, sources)


def _budget_cells(budget: ErrorBudget) -> dict[str, Cell]:
    unexplained, low, high = budget.unexplained_mm2
    return {
        "observed_sd_mm": budget.observed_mm2**0.5,
        "degrees_of_freedom": budget.degrees_of_freedom,
        **budget.sources_mm,
        "explained_sd_mm": budget.explained_mm2**0.5,
        "variance_ratio": budget.observed_mm2 / budget.explained_mm2,
        "unexplained_mm2": unexplained,
        "unexplained_low_mm2": low,
        "unexplained_high_mm2": high,
        "alarm": budget.alarm,
    }


def _coverage_cells(used: pd.DataFrame) -> dict[str, Cell]:
    expanded = COVERAGE_FACTOR * np.hypot(used["stated_u_mm"], used["reference_u_mm"])
    found = interval_coverage(used.assign(expanded_mm=expanded))
    return {"coverage": found.value, "coverage_low": found.low, "coverage_high": found.high}


def _total(budgets: Sequence[ErrorBudget]) -> list[dict[str, Cell]]:
    """Row of all standoffs together, also of a single one: its alarm has the power that the step states."""
    if not budgets:
        return []
    test = budget_test(budgets)
    return [
        {
            "degrees_of_freedom": test.degrees_of_freedom,
            "variance_ratio": test.ratio,
            "alarm": test.probability < JOINT_ALARM,
            "note": f"all standoffs: {probability(test.probability)}",
        }
    ]
