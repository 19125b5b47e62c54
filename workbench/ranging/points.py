"""What a shape is fitted to: where the spots of one line of lasers lie, and how well that is known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.model.stats import chi2_sf, norm_ppf

LEVEL = 0.95
"""Of every interval that the ranger states."""
REACH = float(norm_ppf(0.5 + 0.5 * LEVEL))
"""Standard deviations on either side of the middle of a Gaussian that hold `LEVEL` of it."""


@dataclass(frozen=True)
class Points:
    """n spots on one line, seen from the sensor's front; mm.

    Ranges are taken for Gaussian in the inverse of their depth, as spots are in the image.
    """

    x_mm: FloatArray
    """(n,) place along the front, all different."""
    range_mm: FloatArray
    """(n,) from the reference plane."""
    covariance_mm2: FloatArray
    """(n, n) of the ranges. What a calibration has wrong is common to all of them."""
    offset_mm: float = 0.0
    """Depth = range + offset."""
    x_covariance_mm2: FloatArray | None = None
    """(n, n) of the places; None where they are exact."""
    cross_mm2: FloatArray | None = None
    """(n, n) covariance of range i with place j; None where they are independent."""

    def __post_init__(self) -> None:
        n = len(self.x_mm)
        if n < 1 or len(set(self.x_mm.tolist())) < n:
            raise ValueError(f"expected spots at places that all differ, got {self.x_mm}")
        if np.shape(self.range_mm) != (n,) or np.shape(self.covariance_mm2) != (n, n):
            raise ValueError(f"expected {n} ranges and their covariance for {n} places")
        if not (self.range_mm + self.offset_mm > 0).all():
            raise ValueError(f"expected spots before the pinhole, got ranges {self.range_mm}")

    def __len__(self) -> int:
        return len(self.x_mm)

    def covariances(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(n, n) of ranges, of places, and of range i with place j; zeros for what is exact."""
        none = np.zeros_like(self.covariance_mm2)
        return (
            np.ascontiguousarray(self.covariance_mm2),
            none if self.x_covariance_mm2 is None else np.ascontiguousarray(self.x_covariance_mm2),
            none if self.cross_mm2 is None else np.ascontiguousarray(self.cross_mm2),
        )


class Closest(NamedTuple):
    """The smallest range of a fitted shape over the front, mm."""

    range_mm: float
    sigma_mm: float
    x_mm: float
    by_range: FloatArray
    """(n,) its derivatives by the ranges that were fitted."""
    by_place: FloatArray
    """(n,) and by their places along the front."""


def interval_mm(range_mm: float, sigma_mm: float, offset_mm: float = 0.0) -> tuple[float, float]:
    """The 95 % interval of a range whose inverse depth is Gaussian; its upper end may be infinite.

    Range is convex in the spot's place, so that far away the interval reaches farther beyond the range than
    before it. Where sigma is small against the depth it is the range -+ 1.96 sigma. At or behind the pinhole
    there is no such range: anything before it is possible.
    """
    depth = range_mm + offset_mm
    if depth <= 0:
        return -offset_mm, np.inf
    relative = REACH * sigma_mm / depth
    farthest = depth / (1.0 - relative) if relative < 1 else np.inf
    return depth / (1.0 + relative) - offset_mm, farthest - offset_mm


def probability(chi2: float, freedom: int) -> float | None:
    """Chance of a chi2 at least as large if the model is true; None where nothing is left to test it with."""
    return float(chi2_sf(chi2, freedom)) if freedom > 0 else None
