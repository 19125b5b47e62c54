"""Joint maximum-likelihood fit of several spots in one window, with common background and widths."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray
from workbench.spots.fit import Windows
from workbench.spots.kernels.columns import FLUX, LN_SU, SHEAR, U, V
from workbench.spots.kernels.hidden import most_significant
from workbench.spots.kernels.joint_window import fit_window
from workbench.spots.noise import PixelNoise
from workbench.spots.psf import principal_axes

_HIDDEN_SD = 5.0


@dataclass(frozen=True, slots=True)
class JointFit:
    """Result of a joint fit: spots of one window with common widths (lasers of one kind on one target)."""

    params: FloatArray
    """(k, 6) in the order of `kernels.columns`; background and widths are the same in all rows."""
    sd: FloatArray
    """(k, 3): of flux, u, v; of the position by noise."""
    speckle_sd: FloatArray
    """(k, 2) of u, v by speckle; 0 where the weights were fixed."""
    chi2: float
    """Sum of squared residuals times their weights."""
    signal: FloatArray
    """(height, width) expected value above the background, DN."""
    residual: FloatArray
    """(height, width), DN."""
    weight: FloatArray
    """(height, width) inverse variance, 0 where unused."""
    noise: PixelNoise
    """With slope and contrast measured from the residuals, unless the weights were fixed."""
    converged: bool


def fit_joint(
    win: Windows,
    start: FloatArray,
    noise: PixelNoise,
    weight: FloatArray | None = None,
    assumed: PixelNoise | None = None,
) -> JointFit:
    """Fit k spots in a single window (n = 1).

    Args:
        win: The window.
        start: (k, 6) first guesses.
        noise: Of the window.
        weight: (height, width) fixed weights; None: those that the model predicts.
        assumed: Noise that the measured one is averaged with; None: `noise`.
    """
    params, used = start.copy(), np.empty(win.shape) if weight is None else weight
    of_window, prior = _values(noise), _values(assumed or noise)
    sd, speckle_sd, signal, residual, chi2, slope, contrast2, converged = fit_window(
        win.data[0],
        win.usable[0],
        of_window,
        prior[1:],
        noise.stated_contrast2,
        weight is not None,
        params,
        used,
    )
    measured = PixelNoise(noise.floor_dn2, np.array([slope]), np.array([contrast2]), noise.stated_contrast2)
    return JointFit(params, sd, speckle_sd, chi2, signal, residual, used, measured, converged)


def _values(noise: PixelNoise) -> tuple[float, float, float]:
    """Floor, slope and squared contrast of the only window."""
    return noise.floor_dn2.item(), noise.slope_dn.item(), noise.contrast2.item()


def pair_guess(params: FloatArray) -> FloatArray:
    """(2, 6) first guess of two spots, separated along the long axis of the fit (6,) or (7,) of their sum."""
    widths, axes = principal_axes(params)
    offset = max(np.sqrt(widths[1] ** 2 - widths[0] ** 2), 0.4 * widths[1])
    start = np.stack([params[:SHEAR], params[:SHEAR]])
    start[:, FLUX] *= 0.5
    start[:, LN_SU:] = np.log(widths[0])
    start[0, U:LN_SU] -= offset * axes[:, 1]
    start[1, U:LN_SU] += offset * axes[:, 1]
    return start


def f_statistic(one: float, two: float, pixels: int, parameters: int) -> float:
    """F statistic for three more parameters (a second spot) that lower chi2 from `one` to `two`.

    The denominator is the misfit of the larger model, so that speckle does not count as a second spot.
    """
    left = two / max(pixels - parameters, 1)
    return (one - two) / 3.0 / max(left, 1e-12)


def hidden_spot(joint: JointFit, allowed: BoolArray) -> FloatArray | None:
    """(6,) first guess of a further spot by a matched filter of the residuals; None below 5 sd."""
    su, sv = np.exp(joint.params[0, LN_SU:SHEAR]).tolist()
    height, row, col, flux = most_significant(joint.residual, joint.weight, allowed, su, sv)
    if height < _HIDDEN_SD:
        return None
    hidden: FloatArray = joint.params[0].copy()
    hidden[FLUX], hidden[U], hidden[V] = flux, col, row
    return hidden
