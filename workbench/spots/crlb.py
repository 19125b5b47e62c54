"""Cramer-Rao lower bound of the position of a spot. Derivation: docs/spots.md."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.special import gammaln, xlogy

from workbench.model.arrays import FloatArray
from workbench.model.stats import norm_cdf
from workbench.spots.kernels.columns import FLUX
from workbench.spots.psf import derivatives

# Electrons above which a Poisson count is Gaussian to 1e-3 of its information.
_MANY_ELECTRONS = 400.0
_REACH_WIDTHS = 7.0


@dataclass(frozen=True)
class CameraNoise:
    """Noise of a camera that delivers whole numbers."""

    electrons_per_dn: float
    read_sd_electrons: float
    background_electrons: float


def pixel_information(electrons: float, camera: CameraNoise) -> float:
    """Fisher information (1 / electrons^2) of one pixel's number about its mean number of electrons.

    Exact for Poisson electrons, Gaussian read noise and rounding, averaged over the position of the mean
    between two numbers; above 400 electrons the inverse of the variance.
    """
    read = camera.read_sd_electrons
    gaussian = 1.0 / _variance(electrons, camera)
    if electrons > _MANY_ELECTRONS:
        return gaussian
    # Rounding finer than the read noise or than single electrons loses no information.
    step = max(camera.electrons_per_dn, 0.25 * read, 0.25)
    count = np.arange(0, int(electrons + 10.0 * np.sqrt(electrons) + 20.0))
    mass = np.exp(xlogy(count, electrons) - electrons - gammaln(count + 1.0))
    by_mean = np.concatenate([[0.0], mass[:-1]]) - mass
    reach = 6.0 * np.sqrt(electrons + read**2) + step
    information = []
    for phase in np.linspace(0.0, 1.0, 5)[:-1]:
        numbers = np.arange(np.floor((electrons - reach) / step), np.ceil((electrons + reach) / step)) + phase
        edges = (np.append(numbers, numbers[-1] + 1.0) - 0.5) * step
        share = np.diff(norm_cdf((edges[:, None] - count) / read), axis=0)
        chance = share @ mass
        possible = chance > 1e-12
        information.append(float((((share @ by_mean)[possible]) ** 2 / chance[possible]).sum()))
    return float(np.mean(information))


def _variance(electrons: float, camera: CameraNoise) -> float:
    """Variance of a pixel's number, electrons^2: shot noise, read noise, rounding."""
    return electrons + camera.read_sd_electrons**2 + camera.electrons_per_dn**2 / 12.0


@lru_cache(maxsize=16)
def _excess_curve(camera: CameraNoise) -> tuple[FloatArray, FloatArray]:
    """Means, and the ratio of a pixel's information to its inverse variance; 1 above `_MANY_ELECTRONS`."""
    means = np.geomspace(0.05, _MANY_ELECTRONS, 24)
    excess = np.array([pixel_information(float(m), camera) * _variance(float(m), camera) for m in means])
    return means, np.append(excess[:-1], 1.0)


def fisher_matrix(
    electrons: float, width_px: float, phase_px: tuple[float, float], camera: CameraNoise
) -> FloatArray:
    """(6, 6) information about background, flux, u, v, ln width along u and along v of a round spot.

    Args:
        electrons: Flux of the spot.
        width_px: Standard deviation of its profile.
        phase_px: Centre of the spot relative to the centre of a pixel.
        camera: Noise of the camera.
    """
    half = int(np.ceil(_REACH_WIDTHS * width_px)) + 2
    params = np.array([[0.0, electrons, half + phase_px[0], half + phase_px[1], *[np.log(width_px)] * 2]])
    rows = derivatives(params, (2 * half + 1, 2 * half + 1))[0].reshape(6, -1)
    mean = camera.background_electrons + electrons * rows[FLUX]
    jacobian = rows.copy()
    jacobian[2:] *= electrons
    means, excess = _excess_curve(camera)
    variance = mean + camera.read_sd_electrons**2 + camera.electrons_per_dn**2 / 12.0
    matrix: FloatArray = (jacobian * np.interp(mean, means, excess) / variance) @ jacobian.T
    return matrix


def position_bound_px(
    electrons: float, width_px: float, phase_px: tuple[float, float], camera: CameraNoise
) -> FloatArray:
    """(2,) lowest standard deviation of u and v, px, of an unbiased estimator without prior knowledge."""
    cov = np.linalg.inv(fisher_matrix(electrons, width_px, phase_px, camera))
    bound: FloatArray = np.sqrt(np.diag(cov)[2:4])
    return bound
