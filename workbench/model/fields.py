"""Field types shared by steps of a procedure file."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from workbench.model.prior import LARGEST

Standoff = Annotated[float, Field(gt=0, le=LARGEST)]
Standoffs = Annotated[tuple[Standoff, ...], Field(min_length=1)]
Count = Annotated[int, Field(ge=1, le=1_000_000)]


def require_different(standoffs_mm: tuple[float, ...], repeats: str) -> None:
    """Check that all standoffs differ in their first 12 digits, which are part of the names of frames.

    Args:
        standoffs_mm: standoffs as in the file.
        repeats: key of the number of captures at one standoff, for the message.

    Raises:
        ValueError: a standoff occurs more than once.
    """
    keys = [f"{standoff:.12g}" for standoff in standoffs_mm]
    if doubled := [key for key in dict.fromkeys(keys) if keys.count(key) > 1]:
        raise ValueError(
            f"standoffs_mm: expected each standoff once, got {', '.join(doubled)} mm more than once; for more"
            f" captures at a standoff raise `{repeats}`"
        )
