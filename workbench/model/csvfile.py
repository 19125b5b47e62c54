"""Reader of CSV files from a user, as spreadsheets and scripts write them."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from workbench.model.contents import CONTROL, not_text, printable, read_file
from workbench.model.errors import BadInputError
from workbench.model.problems import one_of, short

SEPARATORS = {";": "semicolons (;)", "\t": "tabs", "|": "bars (|)"}
"""Column separators of other table formats, with their names for messages."""
LARGEST_BYTES = 64 * 2**20
"""Largest file, some 500 000 rows."""
LINE_END = re.compile("\r\n|\r|\n")
FIRST_LINE = ("sep=", '"sep=')
"""Beginning of a line above the header by which spreadsheets state the separator."""


Parsed = TypeVar("Parsed")


@dataclass(frozen=True)
class CsvRow:
    """Row of a table: the cells that are not empty, by column, without spaces around them."""

    line: int
    """Line number of the row's end in the file, from 1."""
    cells: dict[str, str]


def read_csv(path: Path, expected: str) -> bytes:
    """Bytes of a CSV file.

    Args:
        path: file.
        expected: content, for messages, such as "a captures file (CSV)".

    Raises:
        BadInputError: the file cannot be read, or is too large.
    """
    return read_file(path, expected, LARGEST_BYTES)


def parse_csv(
    path: Path,
    content: bytes,
    expected: str,
    check_columns: Callable[[list[str]], None],
    parse_row: Callable[[CsvRow], Parsed],
) -> list[Parsed]:
    """Parse a table.

    Spaces around names and values, rows without any value, columns at the end without name and values, and
    a line `sep=,` above the header are ignored. Control characters are escaped.

    Args:
        path: file, for messages.
        content: its bytes.
        expected: content, for messages, such as "a captures file (CSV)".
        check_columns: check of the columns' names; raises BadInputError.
        parse_row: parser of one row; raises BadInputError.

    Raises:
        BadInputError: the content is not text or not CSV, or `check_columns` refuses the header. One line for
            each error of a row.
    """
    if (got := not_text(content)) is not None:
        raise BadInputError(f"{path}: expected {expected}, got {got}")
    parsed, mistakes = [], []
    try:
        lines = _lines(path, content)
        header = next((cells for _, cells in lines if any(cells)), [])
        names = _without_empty_end(header)
        check_columns(names)
        for line, cells in lines:
            if not any(cells):
                continue
            try:
                parsed.append(parse_row(_row(path, line, len(header), names, cells)))
            except BadInputError as error:
                mistakes.append(str(error))
    except csv.Error as error:
        raise BadInputError(f"{path}: expected {expected}: {error}") from None
    if mistakes:
        raise BadInputError("\n".join(mistakes))
    return parsed


def _lines(path: Path, content: bytes) -> Iterator[tuple[int, list[str]]]:
    """Number and cells of each line, from the header on."""
    text, above = content.decode("utf-8-sig"), 0
    if text.lower().startswith(FIRST_LINE):
        first, text = (*LINE_END.split(text, maxsplit=1), "")[:2]
        above = 1
        separator = first.strip().strip('"')[len("sep=") :]
        if separator != ",":
            raise BadInputError(f"{path}: row 1: {_other_separator(SEPARATORS.get(separator, separator))}")
    reader = csv.reader(io.StringIO(text, newline=""))
    is_plain = CONTROL.search(text.replace("\r\n", "\n")) is None
    for cells in reader:
        plain = cells if is_plain else map(printable, cells)
        yield reader.line_num + above, [cell.strip() for cell in plain]


def _without_empty_end(cells: list[str]) -> list[str]:
    filled = [number for number, cell in enumerate(cells) if cell]
    return cells[: filled[-1] + 1] if filled else []


def _row(path: Path, line: int, columns: int, names: list[str], cells: list[str]) -> CsvRow:
    if len(cells) != columns or any(cells[len(names) :]):
        raise BadInputError(
            f"{path}: row {line}: the number of values differs from the number of columns in the header"
        )
    found = zip(names, cells, strict=False)
    return CsvRow(line, {name: value for name, value in found if value})


def check_header(path: Path, present: Sequence[str], required: Sequence[str], known: Sequence[str]) -> None:
    """Check the names of the columns.

    Args:
        path: file, for messages.
        present: names in the header.
        required: columns that must be present.
        known: all columns of the format.

    Raises:
        BadInputError: the header is empty, or a column is missing, unknown or repeated.
    """
    where = f"{path}: row 1"
    if not present:
        raise BadInputError(
            f"{path}: the file is empty; expected a header with {', '.join(required)} and more"
        )
    if len(present) == 1 and (others := [name for mark, name in SEPARATORS.items() if mark in present[0]]):
        raise BadInputError(f"{where}: {_other_separator(others[0])}")
    if missing := [name for name in required if name not in present]:
        needed, got = ", ".join(required), ", ".join(present)
        raise BadInputError(
            f"{where}: expected the columns {needed}; missing: {', '.join(missing)}; got {short(got)}"
        )
    if unknown := [name for name in present if name not in known]:
        found = "; ".join(f"no such column: {name}; {one_of(name, known)}" for name in unknown)
        raise BadInputError(f"{where}: {found}")
    if len(set(present)) != len(present):
        raise BadInputError(f"{where}: expected every column once, got {', '.join(present)}")


def _other_separator(name: str) -> str:
    return (
        f"expected columns separated by commas, got {name}; save the table as CSV with commas as separators"
        " and decimal points in numbers"
    )
