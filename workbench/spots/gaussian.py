"""The model of a spot: a Gaussian integrated over square pixels, and its derivatives, many spots at once.

A spot is described by six parameters in the order of `Param`: background per pixel, flux, centre u and v (pixels
from the centre of the window's first pixel) and the natural logarithms of the standard deviations along u and v.
Derivation: docs/spots.md.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from scipy.special import ndtr

from workbench.spots.types import Floats

_INV_SQRT_2PI = 0.3989422804014327


class Param(IntEnum):
    """Index of a parameter."""

    BACKGROUND = 0
    FLUX = 1
    U = 2
    V = 3
    LN_SU = 4
    LN_SV = 5


def axis_profiles(centre_px: Floats, ln_sd: Floats, n: int) -> Floats:
    """Share of a unit Gaussian that falls into each of `n` pixels in a row, and its derivatives.

    Args:
        centre_px: Centres, any shape (...).
        ln_sd: Logarithms of the standard deviations in pixels, same shape.
        n: Number of pixels; their centres are 0 .. n - 1.

    Returns:
        (3, ..., n): the share, its derivative by the centre, its derivative by the logarithm of the width.
    """
    sd = np.exp(ln_sd)[..., None]
    z = (np.arange(-0.5, n) - centre_px[..., None]) / sd
    at_edges = np.empty((3, *z.shape))
    at_edges[0] = ndtr(z)
    density = np.exp(-0.5 * z * z) * -_INV_SQRT_2PI
    at_edges[1] = density / sd
    at_edges[2] = density * z
    profiles: Floats = at_edges[..., 1:] - at_edges[..., :-1]
    return profiles


def basis(params: Floats, shape: tuple[int, int]) -> Floats:
    """Derivatives of the pixel values, those by position and width divided by the flux.

    The division makes the basis independent of background and flux, in which the model is linear.

    Args:
        params: (n, 6), see `Param`.
        shape: Height and width of the window.

    Returns:
        (n, 6, height * width).
    """
    height, width = shape
    along_u = axis_profiles(params[:, Param.U], params[:, Param.LN_SU], width)
    along_v = axis_profiles(params[:, Param.V], params[:, Param.LN_SV], height)
    out = np.empty((len(params), 6, height, width))
    out[:, 0] = 1.0
    for row, (of_v, of_u) in enumerate(((0, 0), (0, 1), (1, 0), (0, 2), (2, 0)), start=1):
        np.multiply(along_v[of_v][:, :, None], along_u[of_u][:, None, :], out=out[:, row])
    return out.reshape(len(params), 6, height * width)
