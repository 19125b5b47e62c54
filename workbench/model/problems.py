"""What is wrong with a file's values, in the words of its reader: each mistake once, and where it stands."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic_core import ErrorDetails

Location = tuple[int | str, ...]
LONGEST = 60
EXPECTED = {
    "missing": "is missing",
    "extra_forbidden": "no such key",
    "int_parsing": "expected a whole number",
    "int_type": "expected a whole number",
    "int_from_float": "expected a whole number",
    "float_parsing": "expected a number",
    "float_type": "expected a number",
    "finite_number": "expected a finite number",
    "string_type": "expected text",
    "bool_parsing": "expected true or false",
    "bool_type": "expected true or false",
    "tuple_type": "expected a list",
    "list_type": "expected a list",
    "dict_type": "expected a mapping",
    "model_type": "expected a mapping",
    "model_attributes_type": "expected a mapping",
    "too_short": "expected at least {min_length}, got {actual_length}",
    "too_long": "expected at most {max_length}, got {actual_length}",
    "greater_than": "expected more than {gt}",
    "greater_than_equal": "expected at least {ge}",
    "less_than": "expected less than {lt}",
    "less_than_equal": "expected at most {le}",
    "literal_error": "expected {expected}",
    "union_tag_invalid": "{discriminator}: expected one of {expected_tags}, got '{tag}'",
    "union_tag_not_found": "expected a key {discriminator}",
}
SELF_EVIDENT = {
    "missing", "extra_forbidden", "too_short", "too_long", "union_tag_invalid", "union_tag_not_found",
}  # fmt: skip
"""What came is nothing, or is said already."""


@dataclass(frozen=True)
class Problem:
    """One mistake."""

    location: Location
    """As in the file: without the names of kinds, which pydantic puts in."""
    text: str
    """What was expected, and what came."""

    @property
    def key(self) -> str:
        """As people write it: `lasers[0].x_mm`."""
        key = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in self.location)
        return key.lstrip(".") or "document"


def problems(data: Any, errors: Sequence[ErrorDetails]) -> Iterator[Problem]:
    """Each mistake in `data` once, though pydantic may tell it of every kind of value that was possible."""
    told: set[Location] = set()
    places = [_in_file(data, error["loc"], error["type"]) for error in errors]
    for error, place in zip(errors, places, strict=True):
        # A list whose items are wrong comes out too short; that is no mistake of its own.
        follows = error["type"] == "too_short" and any(
            len(other) > len(place) and other[: len(place)] == place for other in places
        )
        if place not in told and not follows:
            told.add(place)
            yield Problem(place, _say(error))


def short(value: object) -> str:
    """A value in a message."""
    text = repr(value)
    return text if len(text) <= LONGEST else text[: LONGEST - 3] + "..."


def _in_file(data: Any, location: Location, kind: str) -> Location:
    node, place = data, []
    for number, part in enumerate(location):
        there = part in node if isinstance(node, dict) else isinstance(part, int) and isinstance(node, list)
        if there:
            node = node[part]
            place.append(part)
        elif kind == "missing" and number == len(location) - 1:
            place.append(part)
    return tuple(place)


def _say(error: ErrorDetails) -> str:
    context, came = error.get("ctx", {}), f", got {short(error['input'])}"
    if context.get("class_name") == "Prior":
        return f"expected {{value: ..., sd: ...}}{came}"
    known = EXPECTED.get(error["type"])
    if known is None:
        said = error["msg"].removeprefix("Value error, ")
        # A rule about a whole mapping says itself what came of it.
        return f"{said[:1].lower()}{said[1:]}" + ("" if ", got " in said else came)
    return known.format(**context) + ("" if error["type"] in SELF_EVIDENT else came)
