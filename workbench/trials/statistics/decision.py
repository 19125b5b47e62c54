"""Decision against limits with guard bands (ISO 14253-1)."""

from __future__ import annotations

from math import inf, isnan
from typing import Literal

Decision = Literal["pass", "fail", "neither"]


def decide(bounds: tuple[float | None, float | None], low: float, high: float) -> Decision:
    """Decision about a value by its 95 % interval: conformity, non-conformity or neither.

    `pass` if the interval lies inside the bounds, `fail` if it lies outside, else `neither`. With an interval
    error +- U and bounds +- MPE this is ISO 14253-1: abs(error) <= MPE - U, abs(error) >= MPE + U.

    Args:
        bounds: lowest and highest permissible value, in the unit of the value; None: no bound.
        low: lower end of the interval.
        high: upper end of the interval, possibly infinite; equal to `low` for a value without uncertainty.

    Raises:
        ValueError: the ends of the interval are in the wrong order or not numbers.
    """
    if not low <= high or isnan(low) or isnan(high):
        raise ValueError(f"expected low <= high, got {low} and {high}")
    least = -inf if bounds[0] is None else bounds[0]
    most = inf if bounds[1] is None else bounds[1]
    if least <= low and high <= most:
        return "pass"
    return "fail" if high <= least or low >= most else "neither"
