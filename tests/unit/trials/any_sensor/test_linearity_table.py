"""Table of linearity of any sensor's readings."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.trial_readings import drawn_levels
from workbench.trials.any_sensor.linearity_table import COLUMNS, linearity_table
from workbench.trials.statistics.linearity import linearity


def test_linearity_is_that_of_the_mean_over_placements() -> None:
    frame = drawn_levels(3)
    (row,) = linearity_table("t", frame).records()
    means = frame.groupby(["standoff_mm", "placement"])["error_mm"].mean().groupby(level=0).mean()
    true = np.array([300.0, 600.0, 1000.0])
    expected = linearity(true, true + means.to_numpy(np.float64))
    assert (row["levels"], row["readings"], row["full_scale_mm"]) == (3, 72, 700)
    assert row["independent_mm"] == pytest.approx(expected.independent_mm)
    assert row["absolute_percent"] == pytest.approx(expected.absolute_percent)
    assert row["slope"] == pytest.approx(expected.slope)
    assert row["note"] == ""


def test_a_placement_with_more_readings_weighs_the_same() -> None:
    frame = drawn_levels(3).query("placement < 2")
    more = frame[(frame["placement"] == 0) | (frame["repeat"] == 0)]
    expected = more.groupby(["standoff_mm", "placement"])["error_mm"].mean().groupby(level=0).mean()
    (row,) = linearity_table("t", more).records()
    assert row["absolute_mm"] == pytest.approx(expected.abs().max())


def test_two_true_ranges_are_stated_in_words() -> None:
    (row,) = linearity_table("t", drawn_levels(1, [300.0, 400.0])).records()
    assert row["slope"] is None
    assert str(row["note"]).startswith("no statistics")


def test_lengths_in_mm_have_that_unit() -> None:
    assert all((column.unit == "mm") == column.key.endswith("_mm") for column in COLUMNS)
