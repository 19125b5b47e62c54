"""Error budget of re-placed readings."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tests.support.statistics import spread
from tests.support.trial_readings import drawn_levels
from workbench.trials.repeatability.budget import COLUMNS, budget_table
from workbench.trials.statistics.error_budget import ALARM_PROBABILITY


def stated(frame: pd.DataFrame, spot_u_mm: float = 0.3, placement_u_mm: float = 0.5) -> pd.DataFrame:
    """Readings with these uncertainties, calibration and common tilt of 0.1 mm."""
    return frame.assign(
        spot_u_mm=spot_u_mm,
        placement_u_mm=placement_u_mm,
        reference_u_mm=np.hypot(placement_u_mm, 0.1),
        stated_u_mm=np.hypot(spot_u_mm, 0.1),
    )


def test_columns_of_the_sources_are_uncertainties_in_mm() -> None:
    rows = budget_table("t", stated(drawn_levels(1))).records()
    assert len(rows) == 4
    assert (rows[0]["spot_u_mm"], rows[0]["reference_u_mm"]) == pytest.approx((0.3, 0.5))
    assert rows[0]["explained_sd_mm"] == pytest.approx(np.hypot(0.3, 0.5))
    assert all((column.unit == "mm") == column.key.endswith("_mm") for column in COLUMNS)


@pytest.mark.thorough
def test_alarms_are_rare_with_complete_and_frequent_with_missing_sources() -> None:
    """Readings with noise 0.3 and placement 0.5 mm; the missing source equals the others together."""
    trials, complete, incomplete = 40, 0, 0
    standoffs_mm = (300.0, 400.0, 500.0, 600.0, 700.0, 800.0, 900.0, 1000.0)
    for seed in range(trials):
        frame = drawn_levels(seed, standoffs_mm)
        complete += budget_table("t", stated(frame)).records()[-1]["alarm"] is True
        half = stated(frame, 0.3 / 2**0.5, 0.5 / 2**0.5)
        incomplete += budget_table("t", half).records()[-1]["alarm"] is True
    assert complete / trials < ALARM_PROBABILITY + spread(ALARM_PROBABILITY, trials)
    assert incomplete / trials > 0.8


def test_a_negative_component_is_not_truncated() -> None:
    """Equal means of 8 placements with 3 repeats: 2/3 of the variance within them."""
    frame = drawn_levels(1, [300.0])
    frame = frame.assign(error_mm=0.3 * (frame["repeat"] - 1))
    row, _ = budget_table("t", stated(frame)).records()
    assert row["observed_sd_mm"] == pytest.approx(0.3 * (2 / 3) ** 0.5)


def test_intervals_that_hold_cover_all_placements() -> None:
    row = budget_table("t", stated(drawn_levels(1, [300.0]))).records()[0]
    wide = budget_table("t", stated(drawn_levels(1, [300.0]), 5.0, 5.0)).records()[0]
    assert wide["coverage"] == 1
    assert isinstance(row["coverage_low"], float)
    assert isinstance(row["coverage"], float)
    assert row["coverage_low"] < row["coverage"]


@pytest.mark.parametrize("column", ["spot_u_mm", "placement_u_mm"])
def test_unknown_uncertainties_are_stated_in_words(column: str) -> None:
    (row,) = budget_table("t", stated(drawn_levels(1, [300.0])).assign(**{column: np.nan})).records()
    assert (row["observed_sd_mm"], row["alarm"]) == (None, None)
    assert str(row["note"]).startswith("no budget")


def test_too_few_placements_and_exact_statements_are_stated_in_words() -> None:
    (one,) = budget_table("t", stated(drawn_levels(1, [300.0], (1, 1, 3)))).records()
    (exact,) = budget_table("t", stated(drawn_levels(1, [300.0]), 0.0, 0.0)).records()
    for row in (one, exact):
        assert row["variance_ratio"] is None
        assert str(row["note"]).startswith("no budget")
