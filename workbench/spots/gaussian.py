"""Models of a spot: Gaussians integrated over square pixels, with their derivatives, many windows at once.

Pixels count from the centre of the window's first pixel. Derivation: docs/spots.md.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.special import ndtr

from workbench.spots.types import Floats

_MINUS_INV_SQRT_2PI: Final = -0.3989422804014327
BACKGROUND, FLUX, U, V, LN_SU, LN_SV, SHEAR = range(7)
"""Order of the parameters of one spot: DN per pixel, DN, pixels, pixels, ln(pixels) twice, pixels per pixel."""
# Three nodes of Gauss and Legendre integrate a pixel of the narrowest spot to 1e-4 of its peak.
_NODES, _NODE_WEIGHTS = np.polynomial.legendre.leggauss(3)


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
    ndtr(z, out=at_edges[0])
    density = np.exp(-0.5 * z * z)
    density *= _MINUS_INV_SQRT_2PI
    np.divide(density, sd, out=at_edges[1])
    np.multiply(density, z, out=at_edges[2])
    profiles: Floats = at_edges[..., 1:] - at_edges[..., :-1]
    return profiles


def upright(params: Floats, shape: tuple[int, int]) -> Floats:
    """Basis of ellipses whose axes lie along rows and columns.

    Args:
        params: (n, 6) in the order BACKGROUND .. LN_SV.
        shape: Height and width of the window.

    Returns:
        (n, 6, height * width): derivatives of the pixel values; those by position and width still to be
        multiplied by the flux, so that nothing degenerates when it vanishes.
    """
    height, width = shape
    axes = params[:, U:SHEAR]
    along_u = axis_profiles(axes[:, 0], axes[:, 2], width)
    along_v = axis_profiles(axes[:, 1], axes[:, 3], height)
    out = np.empty((len(params), 6, height, width))
    out[:, BACKGROUND] = 1.0
    by_u, by_v = along_u[:, :, None, :], along_v[:, :, :, None]
    np.multiply(by_v[0], by_u[0], out=out[:, FLUX])
    np.multiply(by_v[0], by_u[1], out=out[:, U])
    np.multiply(by_v[1], by_u[0], out=out[:, V])
    np.multiply(by_v[0], by_u[2], out=out[:, LN_SU])
    np.multiply(by_v[2], by_u[0], out=out[:, LN_SV])
    return out.reshape(len(params), 6, height * width)


def sheared(params: Floats, shape: tuple[int, int]) -> Floats:
    """Basis of ellipses at any angle: the centre along u moves by `SHEAR` pixels per row.

    Any ellipse is an upright one sheared along u. Rows are integrated by quadrature, columns exactly.

    Args:
        params: (n, 7) in the order BACKGROUND .. SHEAR; LN_SU is the width along u at a fixed row.
        shape: Height and width of the window.

    Returns:
        (n, 7, height * width), as `upright`.
    """
    height, width = shape
    sd_v = np.exp(params[:, LN_SV, None, None])
    dv = np.arange(height)[:, None] + 0.5 * _NODES - params[:, V, None, None]
    z = dv / sd_v
    mass = 0.5 * _NODE_WEIGHTS * -_MINUS_INV_SQRT_2PI / sd_v * np.exp(-0.5 * z * z)
    shear = params[:, SHEAR, None, None]
    ln_su = np.broadcast_to(params[:, LN_SU, None, None], dv.shape)
    share, by_u, by_width = axis_profiles(params[:, U, None, None] + shear * dv, ln_su, width)
    parts = (
        (mass, share),
        (mass, by_u),
        (mass * z / sd_v, share),
        (mass, by_width),
        (mass * (z * z - 1.0), share),
        (mass * dv, by_u),
    )
    rows = [np.ones((len(params), height, width))]
    rows += [np.einsum("nhk,nhkw->nhw", along_v, along_u) for along_v, along_u in parts]
    rows[V] -= shear * rows[U]
    return np.stack(rows, axis=1).reshape(len(params), 7, height * width)


def principal_widths_px(ln_su: float, ln_sv: float, shear: float) -> tuple[float, float]:
    """Standard deviations along the long and the short axis of a sheared ellipse."""
    su, sv = float(np.exp(ln_su)), float(np.exp(ln_sv))
    covariance = np.array([[su**2 + (shear * sv) ** 2, shear * sv**2], [shear * sv**2, sv**2]])
    short, long = np.sqrt(np.maximum(np.linalg.eigvalsh(covariance), 0.0))
    return float(long), float(short)
