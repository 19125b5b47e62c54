"""Statistics of the missing-spots trial."""

from __future__ import annotations

import pytest

from tests.support.four_lasers import reading
from workbench.model.event import ReadingTaken, TrueValues
from workbench.trials.missing_spots.sets import ALL, Condition
from workbench.trials.missing_spots.statistics import missing_summary
from workbench.trials.statistics.coverage import clopper_pearson, upper_bound


def errors(true_mm: float, *errors_mm: float | None) -> list[ReadingTaken]:
    true = TrueValues(range_mm=true_mm, range_sd_mm=0.3)
    return [reading(true, range_mm=None if e is None else true_mm + e) for e in errors_mm]


def test_errors_are_compared_at_the_same_placements() -> None:
    full = [errors(400.0, 0.4, -0.4), errors(800.0, 0.8), errors(1000.0, None)]
    own = [errors(400.0, -0.8), errors(800.0, 0.8, None), errors(1000.0, 50.0)]
    found = missing_summary(Condition(1), own, full)
    assert (found.condition, found.readings, found.without_range) == (Condition(1), 3, 1)
    assert found.ratio == pytest.approx((0.8 / 400 + 0.8 / 800) / (0.4 / 400 + 0.8 / 800))
    assert found.mean_absolute_relative_error == pytest.approx((0.8 / 400 + 0.8 / 800 + 50 / 1000) / 3)


def test_coverage_counts_placements_not_readings() -> None:
    """The interval of a reading is +-1.14 mm."""
    own = [errors(400.0, 0.1, 0.2, 0.3, 2.0), errors(800.0, 0.0)]
    found = missing_summary(ALL, own, own)
    assert found.coverage == pytest.approx((0.75 + 1.0) / 2)
    assert found.coverage_low is not None
    assert found.coverage_low < clopper_pearson(1.75, 2)[0]


def test_placements_that_share_the_calibration_count_as_fewer() -> None:
    """A stated 0.5 mm common to all, and 0.3 mm of each placement: variances 0.25 and 0.09 mm2."""
    own = [errors(400.0 + n, 0.0) for n in range(10)]
    found = missing_summary(ALL, own, own)
    rho = 0.25 / 0.34
    number = 100 / (10 + 90 * rho**2)
    assert (found.coverage_low, found.coverage_high) == pytest.approx(clopper_pearson(number, number))
    exact = [[one.model_copy(update={"sigma_mm": 0.0}) for one in of] for of in own]
    independent = missing_summary(ALL, exact, exact)
    assert (independent.coverage_low, independent.coverage_high) == clopper_pearson(10, 10)


def test_without_any_range_there_is_no_error() -> None:
    own = [errors(400.0, None)]
    found = missing_summary(Condition(3), own, own)
    assert (found.readings, found.ratio, found.coverage, found.coverage_low) == (0, None, None, None)


def test_a_full_set_without_error_has_no_ratio() -> None:
    full, own = [errors(400.0, 0.0)], [errors(400.0, 0.4)]
    found = missing_summary(Condition(1), own, full)
    assert found.ratio is None
    assert found.mean_absolute_relative_error == pytest.approx(0.001)


@pytest.mark.parametrize("lost", [0, 1])
def test_lost_readings_have_an_upper_bound_by_placement(lost: int) -> None:
    own = [errors(400.0, *([None] * lost), *([0.1] * (2 - lost))), *([errors(800.0, 0.1, 0.2)] * 9)]
    found = missing_summary(Condition(1), own, own)
    assert found.lost == pytest.approx(lost / 20)
    assert found.lost_high == pytest.approx(upper_bound(lost / 2, 10))
