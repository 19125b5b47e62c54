"""Header of a CSV file from a user."""

from __future__ import annotations

from pathlib import Path

import pytest

from workbench.model.csvfile import CsvRow, check_header, parse_csv
from workbench.model.errors import BadInputError

REQUIRED, KNOWN = ("true_mm", "measured_mm"), ("true_mm", "measured_mm", "placement")


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_the_stated_separator_ends_with_any_line_end(end: str) -> None:
    rows = parsed(end.join(("sep=,", "true_mm,measured_mm", "1,2", "3,4", "")))
    assert [row.cells for row in rows] == [
        {"true_mm": "1", "measured_mm": "2"},
        {"true_mm": "3", "measured_mm": "4"},
    ]


def test_required_columns_in_any_order_are_accepted() -> None:
    check_header(Path("r.csv"), ["measured_mm", "placement", "true_mm"], REQUIRED, KNOWN)


@pytest.mark.parametrize(
    ("present", "words"),
    [
        ([], ["r.csv", "true_mm"]),
        (["true_mm;measured_mm"], ["row 1", "semicolons"]),
        (["true_mm\tmeasured_mm"], ["row 1", "tabs"]),
        (["true_mm"], ["row 1", "measured_mm"]),
        ([*KNOWN, "placment"], ["row 1", "placment"]),
        ([*KNOWN, "placement"], ["row 1", "once"]),
    ],
)
def test_a_wrong_header_is_refused_with_its_row(present: list[str], words: list[str]) -> None:
    with pytest.raises(BadInputError) as caught:
        check_header(Path("r.csv"), present, REQUIRED, KNOWN)
    assert all(word in str(caught.value) for word in words)


def parsed(text: str) -> list[CsvRow]:
    return parse_csv(
        Path("r.csv"),
        text.encode(),
        "readings",
        lambda names: check_header(Path("r.csv"), names, REQUIRED, KNOWN),
        lambda row: row,
    )


PLAIN = [CsvRow(2, {"true_mm": "1", "measured_mm": "2"}), CsvRow(3, {"true_mm": "3"})]


@pytest.mark.parametrize(
    "text",
    [
        "true_mm,measured_mm\n1,2\n3,\n",
        "\ufefftrue_mm,measured_mm\r\n1,2\r\n3,\r\n",
        " true_mm , measured_mm\n 1,2 \n3 ,\n",
        '"true_mm","measured_mm"\n"1","2"\n"3",""\n',
        "true_mm,measured_mm,,\n1,2,,\n3,,,\n,,,\n,,,\n",
        "true_mm,measured_mm\n1,2\n3,\n\n\n",
    ],
)
def test_tables_of_spreadsheets_are_read(text: str) -> None:
    assert parsed(text) == PLAIN


def test_a_line_with_the_separator_is_skipped_and_counted() -> None:
    assert [row.line for row in parsed("sep=,\ntrue_mm,measured_mm\n1,2\n\n3,4\n")] == [3, 5]
    with pytest.raises(BadInputError, match=r"row 1: .*semicolons"):
        parsed("sep=;\ntrue_mm;measured_mm\n1;2\n")


@pytest.mark.parametrize(
    ("text", "row"),
    [
        ("true_mm,measured_mm\n1,2\n1,2,3\n", 3),
        ("true_mm,measured_mm\n1\n", 2),
        ("true_mm,measured_mm,\n1,2,\n1,2,3\n", 3),
    ],
)
def test_a_row_of_another_length_is_named(text: str, row: int) -> None:
    with pytest.raises(BadInputError, match=f"r.csv: row {row}: "):
        parsed(text)


def test_all_wrong_rows_are_named() -> None:
    with pytest.raises(BadInputError) as caught:
        parsed("true_mm,measured_mm\n1\n1,2\n1,2,3\n")
    assert [line[:12] for line in str(caught.value).splitlines()] == ["r.csv: row 2", "r.csv: row 4"]
