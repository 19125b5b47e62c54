"""Speckle on the sensor: interference pattern of a rough surface imaged through the lens's pupil."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from workbench.model.arrays import FloatArray

MAP_PX = 256
"""Side of a map of speckle, pixels."""


def subsamples(grain_px: float) -> int:
    """Number of samples along a pixel's side: 1.5 per grain of lambda N (in pixels), from 4 to 16.

    The amplitude contains frequencies up to 0.5 / (lambda N), the intensity up to 1 / (lambda N).
    """
    return int(np.clip(np.ceil(1.5 / grain_px), 4, 16))


def speckle_field(
    shape: tuple[int, int], step_px: float, grain_px: float, contrast: float, rng: Generator
) -> FloatArray:
    """Relative intensity of a speckle pattern at intervals of `step_px`: mean 1, sd `contrast`.

    A circular pupil of diameter 1 / (lambda N) in spatial frequency passes random, independent amplitudes.
    The squared modulus of their transform has the negative exponential statistics of fully developed speckle,
    and grains of area (4 / pi) (lambda N)^2. A contrast below 1 models a depolarising surface.

    Source: J. W. Goodman, Speckle Phenomena in Optics, 2007, sections 3.2 and 4.4.
    """
    frequency_v = np.fft.fftfreq(shape[0], step_px)[:, None]
    frequency_u = np.fft.fftfreq(shape[1], step_px)[None, :]
    pupil = np.hypot(frequency_u, frequency_v) <= 0.5 / grain_px
    amplitudes = np.zeros(shape, dtype=np.complex128)
    count = int(pupil.sum())
    amplitudes[pupil] = rng.standard_normal(count) + 1j * rng.standard_normal(count)
    intensity = np.abs(np.fft.ifft2(amplitudes)) ** 2 * (amplitudes.size**2 / (2 * count))
    return np.asarray(1 + contrast * (intensity - 1))


class SpeckleMap:
    """Speckle averaged over pixels, in a square map from which windows are cut at random.

    A window of a spot covers some hundredths of the map, so that patterns seldom share pixels.
    """

    def __init__(self, grain_px: float, contrast: float, rng: Generator) -> None:
        n = subsamples(grain_px)
        field = speckle_field((MAP_PX * n, MAP_PX * n), 1 / n, grain_px, contrast, rng)
        self._map = field.reshape(MAP_PX, n, MAP_PX, n).mean(axis=(1, 3))

    def cut(self, shape: tuple[int, ...], rng: Generator) -> FloatArray:
        """Relative intensity (height, width) of each pixel; the map continues at its opposite edge."""
        top, left = rng.integers(0, MAP_PX, 2)
        rows, columns = (np.arange(side) for side in shape)
        return np.asarray(self._map[np.ix_((top + rows) % MAP_PX, (left + columns) % MAP_PX)])
