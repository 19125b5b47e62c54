"""Table and chart of a gauge R&R study."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tests.support.trial_readings import drawn_levels
from workbench.model.limit import Limit
from workbench.trials.gauge_rr.table import COLUMNS, gauge_chart, gauge_table
from workbench.trials.gauge_rr.trial import gauge_results
from workbench.trials.statistics.gauge_rr import gauge_rr

STANDOFFS_MM = (300.0, 301.0, 302.0, 303.0)


def limit(low: float | None, high: float | None) -> Limit:
    return Limit.model_validate({"in": [low, high]})


def study(seed: int = 1, repeats: int = 1) -> pd.DataFrame:
    """Three operators (sessions) with three placements each."""
    return drawn_levels(seed, STANDOFFS_MM, (3, 3, repeats), (0.2, 0.1, 0.05))


def test_components_are_those_of_the_statistics() -> None:
    frame = study()
    rows = {str(row["component"]).split()[0]: row for row in gauge_table("t", frame).records()}
    found = gauge_rr(frame.assign(part=frame["standoff_mm"], operator=frame["session"]))
    assert rows["EV"]["sd_mm"] == pytest.approx(found.equipment.value)
    assert rows["GRR"]["high_mm"] == pytest.approx(found.gauge.high)
    assert rows["GRR"]["distinct_categories"] == pytest.approx(found.distinct_categories)
    assert rows["GRR"]["study_variation"] == pytest.approx(found.gauge_share)
    assert rows["TV"]["study_variation"] == pytest.approx(1)
    assert list(rows) == ["EV", "AV", "interaction", "GRR", "PV", "TV"]


def test_without_equal_repeatability_there_is_no_interval_and_no_decision() -> None:
    """The repeatability at the last standoff is ten times that at the others."""
    frame = study()
    factor = np.where(frame["standoff_mm"] == STANDOFFS_MM[-1], 10.0, 1.0)
    random = np.random.default_rng(3)
    error = 0.3 * factor * random.standard_normal(len(frame))
    table = gauge_table("t", frame.assign(error_mm=error))
    rows = {str(row["component"]).split()[0]: row for row in table.records()}
    for name in ("EV", "GRR"):
        assert isinstance(rows[name]["sd_mm"], float)
        assert (rows[name]["low_mm"], rows[name]["high_mm"]) == (None, None)
        assert str(rows[name]["note"]).startswith("no interval")
    decisions = [
        one.decision(limit(None, 1e5)) for one in gauge_results(table) if one.quantity == "gauge_sd_mm"
    ]
    assert decisions == ["neither"]


def test_a_gauge_without_scatter_passes_a_limit_on_categories() -> None:
    results = {one.quantity: one for one in gauge_results(gauge_table("t", study().assign(error_mm=0.0)))}
    assert results["distinct_categories"].decision(limit(5.0, None)) == "pass"
    assert results["study_variation"].decision(limit(None, 0.1)) == "pass"


def test_lengths_in_mm_have_that_unit() -> None:
    assert all((column.unit == "mm") == column.key.endswith("_mm") for column in COLUMNS)


def test_readings_at_one_placement_are_one_trial() -> None:
    frame = study(2, repeats=4)
    means = frame.groupby(["standoff_mm", "session", "placement"])["error_mm"].mean().reset_index()
    assert gauge_table("t", frame).rows == gauge_table("t", means).rows


def test_a_target_beside_its_standoff_is_not_an_error_of_the_operator() -> None:
    frame = study()
    moved = frame["true_mm"] + np.random.default_rng(1).normal(0, 3, len(frame))
    displaced = frame.assign(true_mm=moved, measured_mm=moved + frame["error_mm"])
    assert gauge_table("t", displaced).rows == gauge_table("t", frame).rows


@pytest.mark.parametrize("column", ["session", "standoff_mm", "placement"])
def test_a_study_that_separates_nothing_is_stated_in_words(column: str) -> None:
    (row,) = gauge_table("t", study().assign(**{column: 1})).records()
    assert row["sd_mm"] is None
    assert str(row["note"]).startswith("no statistics")
    assert all(f"column {name}" in str(row["note"]) for name in ("session", "placement"))


def test_a_missing_trial_is_named_with_operator_and_standoff() -> None:
    frame = study().assign(session=lambda one: one["session"].map({0: "Ann", 1: "Bob", 2: "Cid"}))
    frame.loc[
        (frame["standoff_mm"] == 302) & (frame["session"] == "Bob") & (frame["placement"] == 1), "error_mm"
    ] = np.nan
    (row,) = gauge_table("t", frame).records()
    assert "302" in str(row["note"])
    assert "Bob" in str(row["note"])


def test_equal_readings_have_no_number_of_categories() -> None:
    rows = gauge_table("t", study().assign(error_mm=0.0)).records()
    assert [row["distinct_categories"] for row in rows] == [None] * 6


def test_chart_has_a_series_for_each_operator() -> None:
    frame = study()
    chart = gauge_chart("t", frame.assign(session=frame["session"].map({0: "Ann", 1: "Bob", 2: "Cid"})))
    assert [series.name for series in chart.series] == ["Ann", "Bob", "Cid"]
    assert all(len(series.x) == 12 for series in chart.series)
