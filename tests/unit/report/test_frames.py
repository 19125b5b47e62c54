"""Records as data frames."""

from __future__ import annotations

import numpy as np

from workbench.model.table import Column, Table
from workbench.report.frames import frame_of, frame_of_table


def test_missing_numbers_are_nan_also_where_all_are_missing() -> None:
    rows: list[dict[str, object]] = [{"a": 1.5, "b": None, "c": "x"}, {"a": None, "b": None, "c": "y"}]
    frame = frame_of(rows, ("c", "a", "b"))
    assert list(frame.columns) == ["c", "a", "b"]
    assert frame["a"].dtype == frame["b"].dtype == np.float64
    assert frame["b"].isna().all()
    assert frame["a"].tolist()[0] == 1.5


def test_no_rows_leave_the_columns() -> None:
    frame = frame_of([], ("a", "b"))
    assert list(frame.columns) == ["a", "b"]
    assert frame.empty


def test_table_keeps_unscaled_values() -> None:
    column = Column(key="error", name="error", unit="%", scale=100.0)
    frame = frame_of_table(Table(name="t", title="T", columns=(column,), rows=((0.01,), (None,))))
    assert frame["error"].tolist()[0] == 0.01
    assert frame["error"].isna().tolist() == [False, True]
