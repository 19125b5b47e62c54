"""Statistics of errors, their tables and charts."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.four_lasers import reading
from workbench.model.chart import Axis
from workbench.model.event import TrueValues
from workbench.trials.errors import (
    ErrorPoint,
    error_cells,
    error_columns,
    error_statistics,
    missing_table,
    quantity_chart,
    range_statistics,
)

TRUE = TrueValues(range_mm=400.0, range_sd_mm=0.3)


def test_statistics_of_errors_without_the_missing_ones() -> None:
    found = error_statistics([1.0, None, -0.5, 2.0], [0.3, None, 0.4, 0.5], 1.2)
    errors = np.array([1.0, -0.5, 2.0])
    assert (found.n, found.missing) == (3, 1)
    assert (found.mean, found.largest, found.smallest) == pytest.approx((errors.mean(), 2.0, -0.5))
    assert (found.sd, found.mean_absolute) == pytest.approx((errors.std(ddof=1), 3.5 / 3))
    assert found.expanded == pytest.approx(2 * np.sqrt((0.09 + 0.16 + 0.25) / 3 + 1.44))


@pytest.mark.parametrize(("errors", "n"), [([None, None], 0), ([0.5], 1)])
def test_too_few_errors_have_no_deviation(errors: list[float | None], n: int) -> None:
    found = error_statistics(errors, [None if e is None else 0.1 for e in errors], 0.1)
    assert (found.n, found.sd) == (n, None)
    assert (found.mean is None) == (n == 0)


def test_cells_have_columns_and_the_relative_error_is_positive() -> None:
    found = error_statistics([1.0, -3.0], [0.1, 0.1], 0.1)
    cells = error_cells(found, -50.0)
    assert len(cells) == len(error_columns("deg", ".2f"))
    assert cells[-1] == pytest.approx(2.0 / 50.0)
    assert error_cells(error_statistics([None], [None], 0.1), 50.0)[-1] is None


def test_range_errors_are_relative_to_the_true_closest_range() -> None:
    found = range_statistics([reading(TRUE, range_mm=401.0), reading(TRUE, range_mm=402.0)])
    assert found.mean == pytest.approx(1.5)
    assert found.expanded == pytest.approx(2 * np.hypot(0.5, 0.3))


def test_every_missing_value_is_listed_with_its_cause() -> None:
    seen = reading(TRUE, range_mm=401.0, shape="flat", notes=("L1: no spot was seen",))
    lost = reading(TRUE, notes=("no spot was seen",))
    assert missing_table("t", [seen]) == []
    (table,) = missing_table("t", [seen, lost])
    assert table.rows == ((400.0, lost.scene, "no spot was seen"),)
    (angles,) = missing_table("t", [seen, lost], "angle", "angle_deg")
    assert [row[2] for row in angles.rows] == ["shape: flat; L1: no spot was seen", "no spot was seen"]


def test_an_error_beyond_three_expected_deviations_is_an_outlier() -> None:
    points = [
        ErrorPoint(300.0, 4.0, 1.0, 1.0),
        ErrorPoint(400.0, 5.0, 1.0, 1.0),
        ErrorPoint(500.0, 9.0, None, 1.0),
    ]
    chart = quantity_chart("c", "C", Axis(label="error", unit="mm"), {"30 deg": points})
    (series,) = chart.series
    assert [series.is_outlier(index) for index in range(3)] == [False, True, False]
    assert series.x == (300.0, 400.0, 500.0)
