"""Notes of a fit in brief: first sentences, and one line for those of equal kind."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

NULL_DIRECTION = re.compile(r"leaves every spot unchanged|moves no spot by more than its noise")
MORE_DIRECTIONS = re.compile(r"^(\d+) more combinations? of parameters")
RANGE_CHANGE = re.compile(r"Ranges change by up to ([\d.eE+-]+) %")
SENTENCE_END = re.compile(r"(?<=[a-z0-9)%])\. (?=[A-Z])")
VARIABLE = re.compile(r"\S*[\d_]\S*")
"""Words of a note that differ between notes of one kind: numbers, names of lasers, parameters and files."""


def brief_notes(notes: Sequence[str]) -> list[str]:
    """One line for each kind of note, in the order of their first occurrence."""
    directions = [note for note in notes if NULL_DIRECTION.search(note) or MORE_DIRECTIONS.match(note)]
    others = [note for note in notes if note not in directions]
    return [*([_directions_line(directions)] if directions else []), *merge_equal_kinds(others)]


def merge_equal_kinds(notes: Iterable[str]) -> list[str]:
    """First sentences, merged where they differ only in numbers and names: `...; likewise L3, L4`."""
    kinds: dict[str, list[str]] = {}
    for note in notes:
        first = SENTENCE_END.split(note.partition(". Do: ")[0], maxsplit=1)[0].rstrip(".")
        kinds.setdefault(VARIABLE.sub("#", first), []).append(first)
    return [_with_more(members) for members in kinds.values()]


def _with_more(members: Sequence[str]) -> str:
    first, *others = members
    if not others:
        return first
    differing = [_difference(first, other) for other in others]
    names = [names[0] for names in differing if len(names) == 1]
    if len(names) == len(others):
        return f"{first}; likewise {', '.join(names)}"
    return f"{first}; and {len(others)} more like this"


def _difference(first: str, other: str) -> list[str]:
    """Words of a note that another of its kind does not have."""
    return [b.strip(",;:()") for a, b in zip(first.split(), other.split(), strict=True) if a != b]


def _directions_line(notes: Sequence[str]) -> str:
    number = sum(int(more[1]) if (more := MORE_DIRECTIONS.match(note)) else 1 for note in notes)
    are = "combination of parameters is" if number == 1 else "combinations of parameters are"
    changes = [float(found[1]) for note in notes if (found := RANGE_CHANGE.search(note))]
    ranges = f"ranges change by up to {max(changes):g} %" if changes else "ranges are not affected"
    return f"{number} {are} not constrained; {ranges}"
