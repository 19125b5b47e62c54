"""Tables as data: cells for people, records, CSV."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
import pandas as pd
import pytest
from pydantic import ValidationError

from workbench.model.table import Cell, Column, Table
from workbench.trials.accuracy.statistics import AccuracyRow
from workbench.trials.thesis.schema import ClaimRow

TRIAL_ROWS = (
    AccuracyRow(
        standoff_mm=300.0,
        readings=30,
        mean_error_mm=0.1 + 0.2,
        max_error_mm=1e-7,
        min_error_mm=-2.0,
        sd_mm=1 / 3,
        range_sd_mm=0.25,
        reference_sd_mm=0.5,
    ),
    AccuracyRow(standoff_mm=2500.5, readings=0, missing=30, reference_sd_mm=0.5),
)
CLAIM = ClaimRow(
    scene="flat, near",
    source="figure 21",
    quantity="range",
    nearest_mm=45.0,
    farthest_mm=5000.0,
    stated=0.05,
    thesis=None,
    ours=0.0021,
    noisy=1e-5,
    reproduced=None,
    better=True,
)


def table(*rows: tuple[Cell, ...], **columns: dict[str, object]) -> Table:
    described = [Column.model_validate({"key": key, "name": key} | more) for key, more in columns.items()]
    return Table(name="t", title="T", columns=tuple(described), rows=rows)


def table_of(records: list[dict[str, Cell]]) -> Table:
    return Table(
        name="t",
        title="T",
        columns=tuple(Column(key=key, name=key, scale=100, format="+.1f") for key in records[0]),
        rows=tuple(tuple(record.values()) for record in records),
    )


@pytest.mark.parametrize(
    ("column", "cell", "text"),
    [
        ({"format": "+.2f"}, 1.234, "+1.23"),
        ({"format": ".0f", "scale": 100, "unit": "%"}, 0.256, "26"),
        ({}, 1250.0, "1250"),
        ({"format": "sd"}, 0.1234, "0.12"),
        ({"format": "+sd"}, 1234.0, "+1200"),
        ({"format": "+sd"}, -0.1234, "-0.12"),
        ({"format": "+sd"}, 0.0, "0"),
        ({"format": "duration"}, 180.0, "3 min"),
        ({"format": "+.2f"}, None, "-"),
        ({}, "a word", "a word"),
        ({}, True, "!"),
        ({}, False, ""),
    ],
)
def test_a_cell_for_people(column: dict[str, object], cell: Cell, text: str) -> None:
    assert table((cell,), a=column).text(0, 0) == text


@pytest.mark.parametrize(
    ("value", "sd", "text"), [(358.214, 2.14, "358.2"), (358.214, None, "358.214"), (-60.0, 0.0, "-60")]
)
def test_a_value_has_the_digits_of_the_sd_in_its_row(value: float, sd: float | None, text: str) -> None:
    assert table((value, sd), value={"format": "digits of sd"}, sd={}).text(0, 0) == text


def test_digits_are_those_of_scaled_numbers() -> None:
    percent = {"scale": 100, "unit": "%"}
    assert table((0.12345, 0.0021), a={"format": "digits of b"} | percent, b=percent).text(0, 0) == "12.35"


@pytest.mark.parametrize("number", [float("nan"), float("inf"), -float("inf")])
def test_a_number_that_is_not_finite_is_missing(number: float) -> None:
    one = table((number,), a={"format": ".2f"})
    assert one.rows == ((None,),)
    assert one.text(0, 0) == "-"


def test_a_heading_has_the_unit() -> None:
    assert Column(key="a", name="mean error", unit="mm").heading == "mean error (mm)"
    assert Column(key="a", name="share").heading == "share"


def test_numbers_are_told_from_words_and_alarms() -> None:
    one = table((1, "a", True, None, None), (None, "b", False, None, 2.5), a={}, b={}, c={}, d={}, e={})
    assert [one.is_number(i) for i in range(5)] == [True, False, False, False, True]


def test_records_have_keys_and_unscaled_cells() -> None:
    assert table((0.5, None), a={"scale": 100}, b={}).records() == [{"a": 0.5, "b": None}]


@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("records", [[asdict(row) for row in TRIAL_ROWS], [CLAIM.model_dump()] * 2])
def test_csv_is_that_of_a_data_frame_to_the_byte(records: list[dict[str, Cell]], count: int) -> None:
    """Files of the trials are written from the rows' own fields: these stay the same."""
    expected = pd.DataFrame(records[:count]).to_csv(index=False, lineterminator="\n")
    assert table_of(records[:count]).to_csv() == expected


def test_csv_keeps_whole_numbers_whole_beside_a_missing_one() -> None:
    rows: tuple[tuple[Cell, ...], ...] = (
        (3, 0.1 + 0.2, "a,b", True),
        (None, None, None, None),
        (12, 2.0, "", False),
    )
    text = table(*rows, n={}, x={}, word={}, alarm={}).to_csv()
    assert text == 'n,x,word,alarm\n3,0.30000000000000004,"a,b",True\n,,,\n12,2.0,,False\n'


@pytest.mark.parametrize(
    ("scalar", "plain"),
    [
        (np.bool_(True), True),
        (np.int64(3), 3),
        (np.float32(0.5), 0.5),
        (np.float64(2.0), 2.0),
        (np.str_("a"), "a"),
        (np.float32("nan"), None),
        (np.array(7), 7),
    ],
)
def test_a_numpy_scalar_keeps_its_type(scalar: Any, plain: Cell) -> None:
    ((cell,),) = table((scalar,), a={}).rows
    assert (cell, type(cell)) == (plain, type(plain))


def test_csv_without_rows_is_the_header() -> None:
    assert table(a={}, b={}).to_csv() == "a,b\n"


def test_a_table_survives_json() -> None:
    one = table((1, 2.0, "x", True, None), a={"format": "g"}, b={}, c={}, d={}, e={})
    again = Table.model_validate_json(one.model_dump_json())
    assert again == one
    assert [type(cell) for cell in again.rows[0]] == [int, float, str, bool, type(None)]


@pytest.mark.parametrize(
    ("rows", "columns"),
    [
        (((1.0,),), ({"key": "a"}, {"key": "b"})),
        (((1.0, 2.0),), ({"key": "a"}, {"key": "a"})),
        (((1.0,),), ({"key": "a", "format": "digits of b"},)),
        (((1.0,),), ({"key": "a b"},)),
    ],
)
def test_a_table_that_makes_no_sense_is_refused(
    rows: tuple[tuple[Cell, ...], ...], columns: tuple[dict[str, str], ...]
) -> None:
    described = [{"name": "a"} | column for column in columns]
    with pytest.raises(ValidationError):
        Table.model_validate({"name": "t", "title": "T", "columns": described, "rows": rows})
