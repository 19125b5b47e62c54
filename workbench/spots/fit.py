"""Maximum-likelihood fit of many spots at once: Fisher scoring with the variance that the model predicts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray
from workbench.spots.kernels.columns import STATISTIC_COLUMNS
from workbench.spots.kernels.single import fisher_scoring
from workbench.spots.noise import PixelNoise


class Windows(NamedTuple):
    """Windows of equal size, one spot each; all arrays (n, height, width)."""

    data: FloatArray
    """DN."""
    usable: BoolArray
    """False where a pixel is clipped, hot or outside the image."""
    clip_dn: FloatArray
    """Signal at which the pixel clips, DN; infinite where no pixel of the windows is clipped."""

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width."""
        return self.data.shape[1], self.data.shape[2]


@dataclass(frozen=True, slots=True)
class SpotFit:
    """Fits of n windows. `cov` is that of background, flux, and flux times each further parameter."""

    params: FloatArray
    """(n, k)."""
    cov: FloatArray
    """(n, k, k)."""
    signal: FloatArray
    """(n, height, width), expected value above the background, DN."""
    residual: FloatArray
    """(n, height, width), DN."""
    weight: FloatArray
    """(n, height, width), inverse variance, 0 where unused."""
    converged: BoolArray
    """(n,)."""
    noise: PixelNoise
    """With the measured slope and contrast."""
    statistics: FloatArray
    """(n, STATISTIC_COLUMNS) statistics for acceptance; see `kernels.columns`."""


def fit_spots(win: Windows, start: FloatArray, noise: PixelNoise) -> SpotFit:
    """Fit one spot per window, and measure the noise of its light from the residuals.

    Args:
        win: The windows.
        start: (n, k) first guesses as in `kernels.columns`; k is 6 for upright ellipses, 7 for tilted ones.
        noise: Floor (fixed), first guesses of slope and contrast.
    """
    n, k = start.shape
    shape = win.data.shape
    fit = SpotFit(
        start.copy(),
        np.empty((n, k, k)),
        np.empty(shape),
        np.empty(shape),
        np.empty(shape),
        np.empty(n, bool),
        noise.copy(),
        np.empty((n, STATISTIC_COLUMNS)),
    )
    fisher_scoring(
        win.data,
        win.usable,
        win.clip_dn,
        fit.noise.floor_dn2,
        fit.noise.slope_dn,
        fit.noise.contrast2,
        noise.stated_contrast2,
        fit.params,
        fit.cov,
        fit.signal,
        fit.residual,
        fit.weight,
        fit.converged,
        fit.statistics,
    )
    return fit
