"""Decision against a maximum permissible error with guard bands (ISO 14253-1), and tolerance factors."""

from __future__ import annotations

from typing import Literal

import numpy as np
from scipy.stats import chi2, norm

Decision = Literal["pass", "fail", "neither"]


def decide(error_mm: float, mpe_mm: float, expanded_mm: float) -> Decision:
    """Decision about one error, mm: conformity, non-conformity or neither.

    `pass` if abs(error) <= MPE - U, `fail` if abs(error) >= MPE + U, else `neither`.

    Args:
        error_mm: measured - true, mm.
        mpe_mm: maximum permissible error, mm.
        expanded_mm: expanded uncertainty U of the error, mm, with the k that the report states.

    Raises:
        ValueError: the limit is not above 0, or the uncertainty is negative or not a number.
    """
    if not (mpe_mm > 0 and expanded_mm >= 0 and np.isfinite([error_mm, mpe_mm, expanded_mm]).all()):
        raise ValueError(f"expected finite numbers, MPE > 0, U >= 0, got {error_mm}, {mpe_mm}, {expanded_mm}")
    if abs(error_mm) <= mpe_mm - expanded_mm:
        return "pass"
    return "fail" if abs(error_mm) >= mpe_mm + expanded_mm else "neither"


def tolerance_factor(n: int, share: float, confidence: float) -> float:
    """Factor k of the two-sided tolerance interval mean +- k s of n normal values, without unit.

    Source: Howe, Two-sided tolerance limits for normal populations, JASA 64 (1969); NIST/SEMATECH 7.2.6.3.

    Args:
        n: number of values, at least 2.
        share: share of the population inside the interval.
        confidence: confidence that at least this share is inside.
    """
    spread = (n - 1) * (1 + 1 / n) / chi2.ppf(1 - confidence, n - 1)
    return float(norm.ppf(0.5 + share / 2) * np.sqrt(spread))
