"""Names in files: text, also where YAML reads a number."""

from __future__ import annotations

from typing import Annotated

from pydantic import BeforeValidator, Field
from ruamel.yaml.scalarint import ScalarInt


def _as_name(value: object) -> object:
    """Text of a number: YAML reads `id: 1` as a number; to the workbench an id is a name."""
    if not isinstance(value, int) or isinstance(value, bool):
        return value
    width, underscore = getattr(value, "_width", None), getattr(value, "_underscore", None)
    plain = type(value) in (int, ScalarInt) and width in (None, len(str(int(value)))) and underscore is None
    if not plain:  # its digits are lost, as of 01, 0x10 and 1_0
        raise ValueError(
            f"expected text; YAML reads this as the number {int(value)}: write the text in quotes"
        )
    return str(value)


Name = Annotated[str, BeforeValidator(_as_name)]
LaserId = Annotated[Name, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")]
"""Laser id; part of file names, therefore of letters, digits, `_`, `.` and `-`."""
