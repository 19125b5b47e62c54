from __future__ import annotations

import io

import numpy as np
import pandas as pd
import pytest

from workbench.model.event import ReadingTaken
from workbench.trials.accuracy.statistics import accuracy_row
from workbench.trials.accuracy.tables import accuracy_table


def empty(standoff_mm: float = 400.0) -> ReadingTaken:
    return ReadingTaken(
        trial="a.1",
        scene="s",
        standoff_mm=standoff_mm,
        reading=0,
        status="no_points",
        range_mm=None,
        sigma_mm=None,
        reference_sd_mm=0.3,
        lasers=(),
    )


def readings(*ranges_mm: float, sigma_mm: float = 0.4) -> list[ReadingTaken]:
    done = {"status": "done", "sigma_mm": sigma_mm}
    return [empty().model_copy(update=done | {"range_mm": mm}) for mm in ranges_mm]


def test_errors_are_measured_minus_true() -> None:
    row = accuracy_row(readings(401.0, 399.5, 402.0))
    assert (row.mean_error_mm, row.max_error_mm, row.min_error_mm) == pytest.approx((2.5 / 3, 2.0, -0.5))
    assert row.sd_mm == pytest.approx(np.std([1.0, -0.5, 2.0], ddof=1))
    assert row.range_sd_mm == pytest.approx(0.4)
    assert row.reference_sd_mm == 0.3
    assert (row.readings, row.missing) == (3, 0)


def test_readings_without_a_range_are_counted_not_averaged() -> None:
    row = accuracy_row([*readings(401.0), empty()])
    assert (row.readings, row.missing, row.mean_error_mm, row.sd_mm) == (1, 1, 1.0, None)


def test_no_reading_at_all() -> None:
    row = accuracy_row([empty(), empty()])
    assert (row.readings, row.missing, row.mean_error_mm, row.range_sd_mm) == (0, 2, None, None)


def test_the_table_as_csv() -> None:
    rows = [accuracy_row(readings(401.1, 399.3)), accuracy_row([empty(500.0)])]
    table = pd.read_csv(io.StringIO(accuracy_table("a.1", rows).to_csv()))
    assert table["mean_error_mm"][0] == pytest.approx(rows[0].mean_error_mm, rel=1e-14)
    assert table["missing"].tolist() == [0, 1]
    assert np.isnan(table["mean_error_mm"][1])
