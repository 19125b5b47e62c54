"""Schema violations of a file as plain messages: each mistake once, with its location in the file."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import date
from difflib import get_close_matches
from typing import Any, Protocol, get_args, runtime_checkable

from pydantic import BaseModel, RootModel
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

Location = tuple[int | str, ...]
LONGEST = 60
"""Characters of a value in a message; longer ones are cut."""
MOST_NAMES = 16
"""Largest number of possible names in a message; the others are only counted."""
WHOLE, NUMBER, MAPPING = "a whole number, such as {number}", "a number, such as {number}", "keys and values"
TRUTH, LIST = "true or false", "a list, such as {items}"
EXPECTED = {
    "missing": "is missing",
    "extra_forbidden": "no such key; {names}",
    "invalid_key": "no such key; {names}",
    "unexpected_keyword_argument": "no such key",
    "int_parsing": WHOLE,
    "int_parsing_size": WHOLE,
    "int_type": WHOLE,
    "int_from_float": WHOLE,
    "float_parsing": NUMBER,
    "float_type": NUMBER,
    "finite_number": "a finite number",
    "string_type": "text, such as {text}",
    "string_unicode": "text in UTF-8",
    "string_pattern_mismatch": "{spelled}",
    "bool_parsing": TRUTH,
    "bool_type": TRUTH,
    "tuple_type": LIST,
    "list_type": LIST,
    "dict_type": MAPPING,
    "path_type": "the path of a file",
    "model_type": MAPPING,
    "model_attributes_type": MAPPING,
    "dataclass_type": MAPPING,
    "too_short": "a list of at least {min_length}, got {actual_length}",
    "too_long": "a list of at most {max_length}, got {actual_length}",
    "greater_than": "more than {gt}",
    "greater_than_equal": "at least {ge}",
    "less_than": "less than {lt}",
    "less_than_equal": "at most {le}",
    "literal_error": "{expected}",
    "union_tag_invalid": "one of {tags}",
    "union_tag_not_found": "the key {discriminator}, which selects the kind",
}
"""Expectation of each of pydantic's error types that our models can raise."""
SPELLED = {
    r"^[A-Za-z0-9_-]+$": "only letters (A to z), digits, _ and -, such as calibrate-flat",
    r"^[a-z0-9-]+$": "only small letters (a to z), digits and -, such as flat-near",
    r"^[A-Za-z0-9][A-Za-z0-9_.-]*$": "letters (A to z), digits, _ . and -, not - or . first, such as L1",
    r"^[A-Za-z0-9_-][A-Za-z0-9_.-]*$": "letters (A to z), digits, _ . and -, not . first, such as flat.1",
    r"^(#[0-9a-fA-F]{6})?$": "# and six digits (0 to 9, a to f), or nothing, such as #56b4e9",
    r"^[ -~]{4}$": "four letters, such as YUYV or GREY",
    r"^head[A-Za-z0-9_.-]*\.yaml$": "a name that begins with head and ends with .yaml, such as head-2.yaml",
    r"^calibration[A-Za-z0-9_.-]*\.yaml$": "a name that begins with calibration and ends with .yaml, such as"
    " calibration-night.yaml, of letters (A to z), digits, _, . and -",
    r"^([A-Z]{2})?$": "two capital letters, such as DE",
    r"^[A-Za-z0-9-]{0,12}$": "at most 12 letters, digits and -, such as LAB-1",
}
"""Descriptions of the models' patterns."""
THOUSANDS = re.compile(r"\s*([+-]?[1-9]\d{0,2}(?:[, ]\d{3})+)(?!\d)")
"""Number whose thousands are separated, such as 2,200."""
STATEMENTS = {"missing", "extra_forbidden", "invalid_key", "unexpected_keyword_argument"}
"""Error types whose text is a statement, not an expectation."""
WITHOUT_GOT = STATEMENTS | {"too_short", "too_long"}
"""Error types without an actual value, or with the actual value in their text."""


BOUNDS = {"greater_than_equal", "less_than_equal"}
"""Error types of a number outside a bound, of which the message names both."""


@runtime_checkable
class LaterModels(Protocol):
    """Annotation of a field whose models are registered by other packages."""

    @staticmethod
    def models() -> list[type[BaseModel]]:
        """Registered models."""


@dataclass(frozen=True)
class SchemaProblem:
    """One mistake in a file's values."""

    location: Location
    """Keys and indices in the file, without the names of kinds that pydantic inserts."""
    text: str
    """Expected and actual value."""

    @property
    def key(self) -> str:
        """Location as text: `lasers[0].x_mm`."""
        key = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in self.location)
        return key.lstrip(".") or "document"

    @property
    def message(self) -> str:
        """Location, expected and actual value in one line."""
        return f"{self.key}: {self.text}"


def problems(model: type[BaseModel], data: Any, errors: Sequence[ErrorDetails]) -> Iterator[SchemaProblem]:
    """Distinct mistakes in `data`, of which pydantic may report each several times.

    Args:
        model: expected model of `data`.
        data: values as read from the file.
        errors: pydantic's errors from validating `data` as `model`.
    """
    places = [_in_file(data, error) for error in errors]
    unknown_keys = [
        place for place, error in zip(places, errors, strict=True) if error["type"] == "extra_forbidden"
    ]
    reported: set[Location] = set()
    for error, place in zip(errors, places, strict=True):
        if place in reported or _is_consequence(error, place, places, unknown_keys):
            continue
        reported.add(place)
        alike = [e for e, other in zip(errors, places, strict=True) if other == place]
        yield SchemaProblem(place, _text(model, error, alike))


def closest_first(word: str, known: Sequence[str]) -> list[str]:
    """Known names, those similar to `word` first."""
    near = get_close_matches(word, known, n=len(known) or 1)
    return [*near, *(name for name in known if name not in near)]


def one_of(word: str, known: Sequence[str]) -> str:
    """Expectation of one of the known names instead of `word`, for a message."""
    names = closest_first(word, known)
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return f"expected one of {', '.join(names[:MOST_NAMES])}{more}"


def short(value: object) -> str:
    """Text of a value for a message, as in the file, cut to `LONGEST` characters."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return str(value).lower()
    text = str(value) if isinstance(value, date) else repr(value)
    return text if len(text) <= LONGEST else text[: LONGEST - 3] + "..."


def _is_consequence(
    error: ErrorDetails, place: Location, places: Sequence[Location], unknown_keys: Sequence[Location]
) -> bool:
    """Whether a mistake is only the consequence of another one."""
    if error["type"] == "too_short":  # pydantic drops wrong items before it counts a list
        return any(len(other) > len(place) and other[: len(place)] == place for other in places)
    # A missing key beside an unknown key of a similar name.
    return error["type"] == "missing" and any(
        other[:-1] == place[:-1] and get_close_matches(str(other[-1]), [str(place[-1])])
        for other in unknown_keys
    )


def _in_file(data: Any, error: ErrorDetails) -> Location:
    location, missing = error["loc"], error["type"] == "missing"
    node, place = data, []
    for number, part in enumerate(location):
        if _has(node, part):
            node = node[part]
            place.append(part)
        elif missing and number == len(location) - 1:
            place.append(part)
    if error["type"] == "union_tag_invalid":
        place.append(error["ctx"]["discriminator"].strip("'"))
    return tuple(place)


def _has(node: Any, part: int | str) -> bool:
    if isinstance(node, list):
        return isinstance(part, int) and part < len(node)
    return isinstance(node, dict) and part in node


def _text(model: type[BaseModel], error: ErrorDetails, alike: Sequence[ErrorDetails]) -> str:
    kind, context = error["type"], error.get("ctx", {})
    value = error["input"]
    if kind == "union_tag_invalid" and isinstance(value, dict):
        value = value.get(context["discriminator"].strip("'"))
    got = f", got {short(value)}"
    if context.get("class_name") == "Prior":
        value = error["input"] if isinstance(error["input"], int | float) else "..."
        return f"expected a value and its standard deviation, {{value: {value}, sd: ...}}{got}"
    if kind == "value_error":
        text = error["msg"].removeprefix("Value error, ")
        # A rule about a whole mapping states the actual value itself.
        return f"{text[:1].lower()}{text[1:]}" + ("" if ", got " in text else got)
    expected = " or ".join(dict.fromkeys(_expected(model, one) for one in alike))
    return (expected if kind in STATEMENTS else f"expected {expected}") + ("" if kind in WITHOUT_GOT else got)


def _expected(model: type[BaseModel], error: ErrorDetails) -> str:
    """Expectation in words, with an example made of the actual value if possible."""
    kind, context, value = error["type"], dict(error.get("ctx", {})), error["input"]
    if kind in {"extra_forbidden", "invalid_key"}:
        context["names"] = one_of(str(error["loc"][-1]), _keys_of(model, error["loc"][:-1]))
    if kind == "union_tag_invalid":
        known = [tag.strip("' ") for tag in context["expected_tags"].split(",")]
        context["tags"] = ", ".join(closest_first(context["tag"], known))
    if kind == "string_pattern_mismatch":
        context["spelled"] = SPELLED.get(context["pattern"], f"text that fits {context['pattern']}")
    if kind in BOUNDS and set(both := _bounds(model, error["loc"])) == {"ge", "le"}:
        return f"{both['ge']:.12g} to {both['le']:.12g}"
    context |= {name: f"{number:.12g}" for name, number in context.items() if isinstance(number, float)}
    context |= {"number": _number_in(value, kind), "items": f"[{value}]" if _plain(value) else "[1, 2]"}
    context["text"] = f'"{value}"' if _plain(value) else '"some words"'
    return EXPECTED.get(kind, "something else here").format(**context)


def _plain(value: object) -> bool:
    return isinstance(value, int | float | str | date) and len(str(value)) < LONGEST


def _number_in(value: object, kind: str) -> str:
    """Number meant by a text with a unit or a decimal comma; an example number if there is none.

    A comma before three digits may separate thousands: both meanings are given.
    """
    if _plain(value) and (grouped := THOUSANDS.match(str(value))) is not None:
        whole, decimal = re.sub("[, ]", "", grouped[1]), grouped[1].replace(",", ".")
        return f"{whole} or {decimal}" if kind.startswith("float") and decimal.count(".") == 1 else whole
    found = re.match(r"\s*([+-]?\d+)(?:[.,](\d+))?", str(value)) if _plain(value) else None
    if kind.startswith("int"):
        return found[1] if found else "10"
    return "12.5" if found is None else found[1] + (f".{found[2]}" if found[2] else "")


def _keys_of(model: type[BaseModel], location: Location) -> list[str]:
    """Permitted keys at a location, which contains the names of kinds that pydantic inserts."""
    return [field.alias or name for name, field in _fields_at(model, location)]


def _bounds(model: type[BaseModel], location: Location) -> dict[str, float]:
    """Bounds of the field at a location, by the name of their constraint; empty for several fields."""
    found = [field for name, field in _fields_at(model, location[:-1]) if location[-1] in (name, field.alias)]
    if len(found) != 1:
        return {}
    bounds = [
        (name, getattr(one, name, None)) for one in found[0].metadata for name in ("ge", "gt", "le", "lt")
    ]
    return {name: bound for name, bound in bounds if bound is not None}


def _fields_at(model: type[BaseModel], location: Location) -> list[tuple[str, FieldInfo]]:
    """Names and fields of the models at a location."""
    here = _models_in(model)
    for part in location:
        fields = [each.model_fields for each in here]
        named = [f.annotation for of in fields for name, f in of.items() if part in (name, f.alias)]
        kinds = [each for each in here if _is_kind(each, part)]
        here = [m for annotation in named for m in _models_in(annotation)] or kinds or here
    return [(name, field) for each in here for name, field in each.model_fields.items()]


def _is_kind(model: type[BaseModel], name: object) -> bool:
    """Whether pydantic refers to the model, one of several at a location, by `name`."""
    return any(name in get_args(field.annotation) for field in model.model_fields.values())


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, RootModel):
        return _models_in(annotation.model_fields["root"].annotation)
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    if isinstance(annotation, type) and issubclass(annotation, LaterModels):
        return annotation.models()
    return [model for part in get_args(annotation) for model in _models_in(part)]
