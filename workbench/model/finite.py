"""Conversion of numbers for JSON, which has none that are not finite."""

from __future__ import annotations

from math import isfinite
from typing import Any


def finite_or_none(value: Any) -> Any:
    """The value unchanged; None instead of an infinite float or NaN."""
    return None if isinstance(value, float) and not isfinite(value) else value
