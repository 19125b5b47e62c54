"""Captures and rows that a fit rejected, one line per reason."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # imported for annotations only: the command starts faster
    from workbench.model.fit_event import Rejected


def rejected_lines(rejected: Iterable[Rejected]) -> list[str]:
    """Lines such as `row 3 and 2 more: no spot`, in the order in which the reasons occur."""
    sources: dict[str, list[str]] = {}
    for r in rejected:
        sources.setdefault(r.reason, []).append(r.source)
    return [f"{_and_more(names)}: {reason}" for reason, names in sources.items()]


def _and_more(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"
