"""Table and chart of repeatability and reproducibility."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy.stats import chi2

from tests.support.trial_readings import autoregressive, drawn_levels
from workbench.model.table import Cell
from workbench.trials.repeatability.table import COLUMNS, precision_chart, precision_table
from workbench.trials.statistics.repeatability import repeatability


def rows(frame: pd.DataFrame) -> list[dict[str, Cell]]:
    return precision_table("p.1-table", frame).records()


def note(row: dict[str, Cell]) -> str:
    return str(row["note"])


def test_each_standoff_has_its_own_statistics() -> None:
    frame = drawn_levels(1)
    for row in rows(frame):
        expected = repeatability(frame[frame["standoff_mm"] == row["standoff_mm"]])
        assert row["repeatability_sd_mm"] == expected.repeatability.value
        assert row["reproducibility_high_mm"] == expected.reproducibility.high
        assert row["reproducibility_limit_mm"] == pytest.approx(2.8 * expected.reproducibility.value)
        assert (row["readings"], row["missing"], row["placements"], row["sessions"]) == (24, 0, 8, 1)
        assert row["session_sd_mm"] is None


def test_units_are_those_of_the_keys() -> None:
    assert all((column.unit == "mm") == column.key.endswith("_mm") for column in COLUMNS)


def test_missing_readings_are_counted() -> None:
    frame = drawn_levels(2, [300.0])
    frame.loc[[0, 5], ["measured_mm", "error_mm"]] = np.nan
    (row,) = rows(frame)
    assert (row["readings"], row["missing"]) == (22, 2)


@pytest.mark.parametrize("shape", [(1, 1, 20), (3, 1, 7)])
def test_repeats_at_one_placement_give_s_r_with_its_interval(shape: tuple[int, int, int]) -> None:
    frame = drawn_levels(1, shape=shape)
    for row, (_, level) in zip(rows(frame), frame.groupby("standoff_mm"), strict=True):
        pooled = float(np.sqrt(level.groupby("session")["error_mm"].var().mean()))
        dof = shape[0] * (shape[2] - 1)
        low, high = pooled * np.sqrt(dof / chi2.ppf([0.975, 0.025], dof))
        assert row["repeatability_sd_mm"] == pytest.approx(pooled)
        assert (row["repeatability_low_mm"], row["repeatability_high_mm"]) == pytest.approx((low, high))
        assert row["repeatability_limit_mm"] == pytest.approx(2.8 * pooled)
        assert row["reproducibility_sd_mm"] is None
        assert "column placement" in note(row)


@pytest.mark.parametrize("shape", [(1, 4, 1), (1, 1, 1)])
def test_too_few_readings_are_stated_in_words_not_as_numbers(shape: tuple[int, int, int]) -> None:
    (row,) = rows(drawn_levels(1, [300.0], shape))
    assert row["repeatability_sd_mm"] is None
    assert note(row).startswith("no statistics")


def test_a_standoff_without_any_range_is_stated_in_words() -> None:
    (row,) = rows(drawn_levels(1, [300.0]).assign(measured_mm=np.nan, error_mm=np.nan))
    assert (row["readings"], row["missing"]) == (0, 24)
    assert note(row).startswith("no statistics")


def test_a_placement_with_other_scatter_or_mean_is_named() -> None:
    frame = drawn_levels(4, [300.0])
    scattered = frame.assign(error_mm=frame["error_mm"] * np.where(frame["placement"] == 5, 12.0, 1.0))
    shifted = frame.assign(error_mm=frame["error_mm"] + np.where(frame["placement"] == 2, 20.0, 0.0))
    assert "0/5" in note(rows(scattered)[0])
    assert "0/2" in note(rows(shifted)[0])
    assert note(rows(frame)[0]) == ""


def test_two_placements_have_no_grubbs_test() -> None:
    (row,) = rows(drawn_levels(1, [300.0], (1, 2, 3)))
    assert row["grubbs_p"] is None
    assert row["cochran_p"] is not None
    assert row["reproducibility_sd_mm"] is not None


@pytest.mark.parametrize("seed", [2, 3, 4])
def test_autocorrelated_repeats_widen_the_interval_of_s_r(seed: int) -> None:
    frame = drawn_levels(seed, [300.0], (1, 8, 40))
    series = autoregressive(np.random.default_rng(seed), 0.5, (8, 40)).ravel()
    shuffled = np.random.default_rng(seed).permutation(series)
    (dependent,), (independent,) = (rows(frame.assign(error_mm=values)) for values in (series, shuffled))

    def width(row: dict[str, Cell]) -> float:
        low, high, sd = (float(row[f"repeatability_{part}_mm"] or 0.0) for part in ("low", "high", "sd"))
        return (high - low) / sd

    assert width(dependent) > 1.15 * width(independent)
    assert "autocorrelated" in note(dependent)
    assert note(independent) == ""


def test_sessions_have_a_component_of_their_own() -> None:
    (row,) = rows(drawn_levels(1, [300.0], (5, 4, 3), (3.0, 0.2, 0.1)))
    assert row["sessions"] == 5
    assert isinstance(row["session_sd_mm"], float)
    assert row["session_sd_mm"] > 1


def test_chart_has_the_statistics_of_the_table() -> None:
    table = precision_table("p.1-table", pd.concat([drawn_levels(1), drawn_levels(2, [50.0], (1, 1, 3))]))
    chart = precision_chart("p.1-precision", table)
    assert [series.name for series in chart.series] == ["s_r", "s_R"]
    assert chart.series[0].x == (300.0, 600.0, 1000.0)
    assert chart.series[1].y == tuple(row["reproducibility_sd_mm"] for row in table.records()[1:])
    assert precision_chart("empty", precision_table("t", drawn_levels(1, [50.0], (1, 1, 3)))).is_empty


def test_coarse_readings_have_no_tests_of_outliers() -> None:
    """Three equal readings at most placements: a variance of 0, and p = 0 for the first that differs."""
    drawn = drawn_levels(2, (500.0,), (1, 8, 3), (0.0, 0.3, 0.3))
    rounded = drawn.assign(measured_mm=drawn["measured_mm"].round(), error_mm=drawn["error_mm"].round())
    (row,) = precision_table("t", rounded).records()
    assert (row["cochran_p"], row["grubbs_p"]) == (None, None)
    assert isinstance(row["note"], str)
    assert "1 mm" in row["note"]
    assert row["reproducibility_sd_mm"] is not None
