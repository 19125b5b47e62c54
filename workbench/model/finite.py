"""Numbers that JSON can hold: what is not finite counts as missing."""

from __future__ import annotations

from math import isfinite
from typing import Any


def finite_or_none(value: Any) -> Any:
    """The value itself; None in place of an infinite float or one that is not a number."""
    return None if isinstance(value, float) and not isfinite(value) else value
