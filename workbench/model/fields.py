"""Field types that several steps of a procedure file share."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from workbench.model.rig import LARGEST

Standoff = Annotated[float, Field(gt=0, le=LARGEST)]
Standoffs = Annotated[tuple[Standoff, ...], Field(min_length=1)]
Count = Annotated[int, Field(ge=1, le=1_000_000)]


def require_different(standoffs_mm: tuple[float, ...], repeats: str) -> None:
    """Refuse a standoff that is listed twice: standoffs name frames, by 12 digits.

    Args:
        standoffs_mm: as in the file.
        repeats: key of the number of captures at one standoff, for the message.

    Raises:
        ValueError: two are the same.
    """
    if len({f"{standoff:.12g}" for standoff in standoffs_mm}) != len(standoffs_mm):
        raise ValueError(f"standoffs_mm must differ: more at one standoff are more `{repeats}`")
