"""Frames of drawn spots for the tests of `workbench.spots`; independent of its model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import erf

from workbench.model.arrays import FloatArray, Image


@dataclass(frozen=True)
class Sensor:
    """Electrons to numbers."""

    electrons_per_dn: float = 8.0
    read_sd: float = 6.0
    bits: int = 12
    black_dn: float = 10.0

    def expose(self, light: FloatArray, rng: np.random.Generator) -> Image:
        electrons = rng.poisson(light) + rng.normal(0.0, self.read_sd, light.shape)
        numbers = np.rint(electrons / self.electrons_per_dn + self.black_dn)
        clipped = np.clip(numbers, 0, 2**self.bits - 1)
        return clipped.astype(np.uint8) if self.bits == 8 else clipped.astype(np.uint16)


@dataclass(frozen=True)
class Drawn:
    """A Gaussian of `electrons`; an ellipse with axes along rows and columns unless turned by `angle`."""

    u: float
    v: float
    electrons: float = 2e4
    su: float = 1.3
    sv: float = 1.3
    angle: float = 0.0


def profile(shape: tuple[int, int], spot: Drawn) -> FloatArray:
    """Light of one spot; turned ellipses by sampling each pixel 9 x 9 times."""
    if spot.angle == 0.0:
        return spot.electrons * _share(spot.v, spot.sv, shape[0])[:, None] * _share(spot.u, spot.su, shape[1])
    fine = np.arange(9) / 9.0 - 4.0 / 9.0
    u = (np.arange(shape[1])[:, None] + fine).ravel() - spot.u
    v = ((np.arange(shape[0])[:, None] + fine).ravel() - spot.v)[:, None]
    cos, sin = np.cos(spot.angle), np.sin(spot.angle)
    exponent = ((cos * u + sin * v) / spot.su) ** 2 + ((cos * v - sin * u) / spot.sv) ** 2
    density = np.exp(-0.5 * exponent) / (2.0 * np.pi * spot.su * spot.sv)
    summed: FloatArray = density.reshape(shape[0], 9, shape[1], 9).mean(axis=(1, 3))
    return spot.electrons * summed


def _share(centre: float, sd: float, n: int) -> FloatArray:
    edges = (np.arange(n + 1) - 0.5 - centre) / (np.sqrt(2.0) * sd)
    share: FloatArray = 0.5 * np.diff(erf(edges))
    return share


def draw(
    spots: Sequence[Drawn],
    rng: np.random.Generator,
    shape: tuple[int, int] = (60, 120),
    sensor: Sensor | None = None,
    ambient: FloatArray | float = 20.0,
) -> Image:
    """A frame with spots."""
    light = np.zeros(shape) + ambient
    for spot in spots:
        light = light + profile(shape, spot)
    return (sensor or Sensor()).expose(light, rng)
