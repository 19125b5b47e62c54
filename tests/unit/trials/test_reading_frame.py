"""Readings as a data frame."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tests.support.trial_readings import autoregressive, drawn_levels, reading_taken
from workbench.model.table import Column
from workbench.trials.reading_frame import COLUMNS, dependence, levels, reading_frame, reading_rows, table_of


def test_rows_have_error_from_the_true_range_and_the_requested_level() -> None:
    readings = [reading_taken(503.0, 502.5, 0), reading_taken(None, 502.5, 1)]
    frame = reading_frame(reading_rows(readings, 500.0, 3))
    assert tuple(frame.columns) == COLUMNS
    assert frame["standoff_mm"].tolist() == [500.0, 500.0]
    assert frame["true_mm"].tolist() == [502.5, 502.5]
    assert frame["error_mm"].tolist() == pytest.approx([0.5, np.nan], nan_ok=True)
    assert frame[["placement", "repeat", "session"]].to_numpy().tolist() == [[3, 0, "1"], [3, 1, "1"]]
    assert frame["status"].tolist() == ["done", readings[1].cause]


def test_a_trial_without_readings_has_the_same_columns() -> None:
    frame = reading_frame([])
    assert tuple(frame.columns) == COLUMNS
    assert frame["error_mm"].dtype == np.float64
    assert dependence(frame).lag1 == 0


def test_levels_ascend() -> None:
    assert [mm for mm, _ in levels(drawn_levels(1, [900.0, 300.0]))] == [300.0, 900.0]


@pytest.mark.parametrize("rho", [0.0, 0.5])
def test_dependence_is_pooled_over_levels_of_different_scatter(rho: float) -> None:
    random = np.random.default_rng(2)
    found = []
    for _ in range(40):
        frame = drawn_levels(1, [300.0, 3000.0], (1, 6, 15))
        series = autoregressive(random, rho, (12, 15)) * np.repeat([1.0, 50.0], 6)[:, None]
        found.append(dependence(frame.assign(error_mm=series.ravel())).estimated)
    assert np.mean(found) == pytest.approx(rho, abs=0.05)


def test_dependence_follows_the_order_of_repeats_not_of_rows() -> None:
    series = autoregressive(np.random.default_rng(5), 0.7, (1, 200)).ravel()
    frame = drawn_levels(1, [300.0], (1, 1, 200)).assign(error_mm=series)
    assert dependence(frame.sample(frac=1, random_state=1)) == dependence(frame)


def test_a_missing_key_is_an_empty_cell() -> None:
    table = table_of("t", "T", [Column(key="a", name="a"), Column(key="b", name="b")], [{"b": 1.0}], "c")
    assert (table.rows, table.caption) == (((None, 1.0),), "c")
    assert isinstance(table.records(), list)
    assert pd.DataFrame(table.records())["b"].tolist() == [1.0]
