"""Check of the header of a CSV file from a user: separators, missing, unknown and repeated columns."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from workbench.model.errors import BadInputError
from workbench.model.problems import one_of, short

SEPARATORS = {";": "semicolons (;)", "\t": "tabs", "|": "bars (|)"}
"""Column separators of other table formats, with their names for messages."""


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
        raise BadInputError(
            f"{where}: expected columns separated by commas, got {others[0]}; save the table as CSV with"
            " commas as separators and decimal points in numbers"
        )
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
