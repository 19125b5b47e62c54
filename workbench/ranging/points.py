"""Points that a shape is fitted to: the spots of one line of lasers, with their covariance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.model.stats import chi2_sf, norm_ppf

LEVEL = 0.95
"""Coverage probability of every interval that the ranger states."""
COVERAGE_FACTOR = float(norm_ppf(0.5 + 0.5 * LEVEL))
"""Coverage factor of a Gaussian for `LEVEL`."""


@dataclass(frozen=True)
class Points:
    """n spots on one line of lasers; mm.

    The inverse depth of a range is Gaussian, as the position of its spot in the image is.
    """

    x_mm: FloatArray
    """(n,) position along the front, all different."""
    range_mm: FloatArray
    """(n,) from the reference plane."""
    covariance_mm2: FloatArray
    """(n, n) of the ranges, including the calibration's error, which they share."""
    offset_mm: float = 0.0
    """Depth = range + offset."""
    x_covariance_mm2: FloatArray | None = None
    """(n, n) of the positions; None where they are exact."""
    cross_mm2: FloatArray | None = None
    """(n, n) covariance of range i with position j; None where they are independent."""

    def __post_init__(self) -> None:
        n = len(self.x_mm)
        if n < 1 or len(set(self.x_mm.tolist())) < n:
            raise ValueError(f"expected spots at different positions, got {self.x_mm}")
        if np.shape(self.range_mm) != (n,) or np.shape(self.covariance_mm2) != (n, n):
            raise ValueError(f"expected {n} ranges and their covariance for {n} positions")
        if not min(self.range_mm.tolist()) + self.offset_mm > 0:
            raise ValueError(f"expected spots in front of the pinhole, got ranges {self.range_mm}")

    def __len__(self) -> int:
        return len(self.x_mm)

    @cached_property
    def covariances(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(n, n) of ranges, of positions, and of range i with position j; zeros where None is stated."""
        none = np.zeros_like(self.covariance_mm2)
        return (
            np.ascontiguousarray(self.covariance_mm2),
            none if self.x_covariance_mm2 is None else np.ascontiguousarray(self.x_covariance_mm2),
            none if self.cross_mm2 is None else np.ascontiguousarray(self.cross_mm2),
        )


class Closest(NamedTuple):
    """Smallest range of a fitted shape over the front, mm."""

    range_mm: float
    sigma_mm: float
    x_mm: float
    by_range: FloatArray
    """(n,) derivatives of `range_mm` by the fitted ranges."""
    by_place: FloatArray
    """(n,) derivatives of `range_mm` by their positions along the front."""


def interval_mm(range_mm: float, sigma_mm: float, offset_mm: float = 0.0) -> tuple[float, float]:
    """95 % interval of a range whose inverse depth is Gaussian; its upper end may be infinite.

    Range is a convex function of the spot's position, so that the interval is asymmetric: longer on the far
    side. Where sigma is small against the depth it is range +- 1.96 sigma. For a range at or behind the
    pinhole it is unbounded from the pinhole on.
    """
    depth = range_mm + offset_mm
    if depth <= 0:
        return -offset_mm, np.inf
    relative = COVERAGE_FACTOR * sigma_mm / depth
    farthest = depth / (1.0 - relative) if relative < 1 else np.inf
    return depth / (1.0 + relative) - offset_mm, farthest - offset_mm


def probabilities(chi2: Sequence[float], freedom: Sequence[int]) -> list[float | None]:
    """P values of n chi2; None without degrees of freedom."""
    p_values = chi2_sf(np.array(chi2), np.array(freedom)).tolist()
    return [p if free > 0 else None for p, free in zip(p_values, freedom, strict=True)]
