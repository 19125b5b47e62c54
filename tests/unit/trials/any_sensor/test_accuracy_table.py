"""Table of errors of any sensor's readings."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tests.support.statistics import spread
from tests.support.trial_readings import autoregressive, drawn_levels
from workbench.model.table import Cell
from workbench.trials.any_sensor.accuracy_table import COLUMNS, accuracy_table


def row(frame: pd.DataFrame) -> dict[str, Cell]:
    (only,) = accuracy_table("t", frame).records()
    return only


def test_lengths_in_mm_have_that_unit() -> None:
    assert all((column.unit == "mm") == column.key.endswith("_mm") for column in COLUMNS)


def test_statistics_are_those_of_the_errors() -> None:
    frame = drawn_levels(1, [400.0])
    found, error = row(frame), frame["error_mm"]
    assert (found["readings"], found["missing"], found["placements"]) == (24, 0, 8)
    assert found["mean_error_mm"] == pytest.approx(error.mean())
    assert (found["max_error_mm"], found["min_error_mm"]) == (error.max(), error.min())
    assert found["sd_mm"] == pytest.approx(error.std())
    assert found["mean_relative_error"] == pytest.approx(error.mean() / 400)


def test_interval_of_the_mean_counts_placements_and_covers_95_percent() -> None:
    trials, inside = 200, 0
    for seed in range(trials):
        found = row(drawn_levels(seed, [400.0], (1, 5, 6), (0.0, 0.5, 0.3)))
        low, high = found["mean_low_mm"], found["mean_high_mm"]
        assert isinstance(low, float)
        assert isinstance(high, float)
        inside += low <= 0 <= high
    assert inside / trials == pytest.approx(0.95, abs=spread(0.95, trials))


@pytest.mark.long_cases
@pytest.mark.parametrize(
    ("design", "sds"),
    [((2, 8, 3), (0.5, 0.2, 0.1)), ((5, 4, 3), (0.5, 0.2, 0.1)), ((3, 8, 3), (0.3, 0.3, 0.3))],
)
def test_interval_of_the_mean_counts_sessions_if_there_are_several(
    design: tuple[int, int, int], sds: tuple[float, float, float]
) -> None:
    trials, inside = 200, 0
    for seed in range(trials):
        found = row(drawn_levels(seed, [400.0], design, sds))
        assert (found["sessions"], found["placements"]) == (design[0], design[0] * design[1])
        low, high = found["mean_low_mm"], found["mean_high_mm"]
        assert isinstance(low, float)
        assert isinstance(high, float)
        inside += low <= 0 <= high
    assert inside / trials == pytest.approx(0.95, abs=spread(0.95, trials))


def test_one_placement_has_no_interval_of_its_mean_error() -> None:
    found = row(drawn_levels(1, [400.0], (1, 1, 5)))
    assert (found["mean_low_mm"], found["mean_high_mm"]) == (None, None)
    assert found["mean_se_mm"] == pytest.approx(float(str(found["sd_mm"])) / 5**0.5)
    assert "one placement" in str(found["note"])


@pytest.mark.parametrize("seed", [2, 3, 4])
def test_autocorrelation_widens_the_standard_error_of_repeats(seed: int) -> None:
    series = autoregressive(np.random.default_rng(seed), 0.5, (1, 200)).ravel()
    found = row(drawn_levels(1, [400.0], (1, 1, 200)).assign(error_mm=series))
    assert 1.3 < float(str(found["mean_se_mm"])) / (series.std(ddof=1) / 200**0.5) < 2.3
    assert "autocorrelated" in str(found["note"])


def test_one_reading_and_none_are_stated_in_words() -> None:
    frame = drawn_levels(1, [400.0], (1, 1, 1))
    one, none = row(frame), row(frame.assign(error_mm=np.nan))
    assert (one["sd_mm"], one["mean_se_mm"]) == (None, None)
    assert "one reading" in str(one["note"])
    assert (none["readings"], none["missing"], none["mean_error_mm"]) == (0, 1, None)
    assert "no statistics" in str(none["note"])


def test_a_true_range_of_zero_has_no_relative_error() -> None:
    assert row(drawn_levels(1, [0.0]))["mean_relative_error"] is None
