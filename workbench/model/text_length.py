"""Bounds of the texts that a person gives for the record; without imports, for a quick command line."""

from __future__ import annotations

LONGEST_NAME = 60
"""Largest number of characters of a person's name or a serial number."""
LONGEST_TEXT = 10_000
"""Largest number of characters of a reason, a note, or an item of the laboratory file: three pages."""


def length_error(text: str, longest: int = LONGEST_TEXT) -> str:
    """Expected and actual length of an overlong text; empty for others."""
    return f"expected at most {longest} characters, got {len(text)}" if len(text) > longest else ""
