"""Light frames for the benchmarks, independent of the code under test: scipy's erf, numpy's generators."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import erf

from workbench.model.arrays import FloatArray, Image


@dataclass(frozen=True)
class Sensor:
    """What turns light into numbers."""

    electrons_per_dn: float
    read_sd_electrons: float
    bits: int
    black_dn: float

    @property
    def full_scale_dn(self) -> int:
        """Highest number."""
        return (1 << self.bits) - 1

    def expose(self, light: FloatArray, rng: np.random.Generator) -> Image:
        """A frame of `light` (electrons expected in each pixel)."""
        electrons = rng.poisson(light) + rng.normal(0.0, self.read_sd_electrons, light.shape)
        numbers = np.rint(electrons / self.electrons_per_dn + self.black_dn)
        clipped = np.clip(numbers, 0, self.full_scale_dn)
        return clipped.astype(np.uint8) if self.bits == 8 else clipped.astype(np.uint16)


def axis_share(centre: float, sd: float, n: int) -> FloatArray:
    """(n,) share of a unit Gaussian in each pixel of a row."""
    edges = (np.arange(n + 1) - 0.5 - centre) / (np.sqrt(2.0) * sd)
    share: FloatArray = 0.5 * np.diff(erf(edges))
    return share


def spot(shape: tuple[int, int], u: float, v: float, su: float, sv: float) -> FloatArray:
    """(height, width): an upright Gaussian of unit sum, integrated over the pixels."""
    return axis_share(v, sv, shape[0])[:, None] * axis_share(u, su, shape[1])
