"""Models of a spot: Gaussians integrated over square pixels, with their derivatives, many windows at once.

Pixels count from the centre of the window's first pixel. A `Design` holds the derivatives of the pixel values
by the parameters at one point; those by position and width are still to be multiplied by the flux, so that
nothing degenerates when the flux vanishes. Derivation: docs/spots.md.
"""

from __future__ import annotations

from typing import Final, Protocol

import numpy as np
from scipy.special import ndtr

from workbench.spots.types import Floats

_MINUS_INV_SQRT_2PI: Final = -0.3989422804014327
BACKGROUND, FLUX, U, V, LN_SU, LN_SV, SHEAR = range(7)
"""Order of a spot's parameters: DN per pixel, DN, pixels, pixels, ln(pixels) twice, pixels per pixel."""
# Three nodes of Gauss and Legendre integrate a pixel of the narrowest spot to 1e-4 of its peak.
_NODES, _NODE_WEIGHTS = np.polynomial.legendre.leggauss(3)
_EDGES: Final = np.arange(-0.5, 128.0)


class Design(Protocol):
    """Derivatives of n windows of (height, width) pixels by k parameters."""

    @property
    def unit(self) -> Floats:
        """(n, height, width): the spot for a flux of 1."""

    def rows(self) -> Floats:
        """(n, k, height * width): all derivatives."""

    def information(self, weight: Floats) -> Floats:
        """(n, k, k): sum over the pixels of weight times the products of the derivatives."""

    def gradient(self, values: Floats) -> Floats:
        """(n, k): sum over the pixels of values times derivatives."""

    def leverage(self, cov: Floats) -> Floats:
        """(n, height, width): variance of the fitted pixel values, from that of the parameters (n, k, k)."""


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
    z = (_EDGES[: n + 1] - centre_px[..., None]) / sd
    at_edges = np.empty((3, *z.shape))
    ndtr(z, out=at_edges[0])
    density = at_edges[2]
    np.multiply(z, z, out=density)
    density *= -0.5
    np.exp(density, out=density)
    density *= _MINUS_INV_SQRT_2PI
    np.divide(density, sd, out=at_edges[1])
    density *= z
    profiles: Floats = at_edges[..., 1:] - at_edges[..., :-1]
    return profiles


# Which factor each parameter's derivative has along v and along u: 0 share, 1 by centre, 2 by width, 3
# constant.
_ALONG_V: Final = np.array([3, 0, 0, 1, 0, 2])
_ALONG_U: Final = np.array([3, 0, 1, 0, 2, 0])
_PAIRS: Final = np.triu_indices(6)
_V_FIRST, _V_SECOND = _ALONG_V[_PAIRS[0]], _ALONG_V[_PAIRS[1]]
_U_FIRST, _U_SECOND = _ALONG_U[_PAIRS[0]], _ALONG_U[_PAIRS[1]]
_UNFOLD: Final = np.zeros((6, 6), np.intp)
_UNFOLD[_PAIRS] = np.arange(21)
_UNFOLD[_PAIRS[::-1]] = np.arange(21)
_MULTIPLICITY: Final = np.where(_PAIRS[0] == _PAIRS[1], 1.0, 2.0)


class Upright:
    """Ellipses whose axes lie along rows and columns.

    Every derivative is a product of a profile along v and one along u. Sums over pixels are therefore taken
    along u first and along v then, and the derivatives themselves are never written out: a tenth of the work.

    Args:
        params: (n, 6) in the order BACKGROUND .. LN_SV.
        shape: Height and width of the window.
    """

    def __init__(self, params: Floats, shape: tuple[int, int]) -> None:
        n = len(params)
        height, width = shape
        if height == width:
            both = axis_profiles(params[:, U:LN_SU].T, params[:, LN_SU:SHEAR].T, width)
            of_u, of_v = both[:, 0], both[:, 1]
        else:
            of_u = axis_profiles(params[:, U], params[:, LN_SU], width)
            of_v = axis_profiles(params[:, V], params[:, LN_SV], height)
        self.along_u = np.ones((4, n, width))
        self.along_u[:3] = of_u
        self.along_v = np.ones((4, n, height))
        self.along_v[:3] = of_v
        self.unit: Floats = of_v[0][:, :, None] * of_u[0][:, None, :]
        self._products: tuple[Floats, Floats] | None = None

    def products(self) -> tuple[Floats, Floats]:
        """Profiles of all pairs of parameters: (21, n, height) along v and (21, n, width) along u."""
        if self._products is None:
            along_u, along_v = self.along_u, self.along_v
            self._products = (
                along_v.take(_V_FIRST, 0) * along_v.take(_V_SECOND, 0),
                along_u.take(_U_FIRST, 0) * along_u.take(_U_SECOND, 0),
            )
        return self._products

    def rows(self) -> Floats:
        """See `Design`."""
        of_v = self.along_v.take(_ALONG_V, 0).transpose(1, 0, 2)
        of_u = self.along_u.take(_ALONG_U, 0).transpose(1, 0, 2)
        rows: Floats = of_v[:, :, :, None] * of_u[:, :, None, :]
        return rows.reshape(*rows.shape[:2], -1)

    def information(self, weight: Floats) -> Floats:
        """See `Design`."""
        of_v, of_u = self.products()
        summed = weight @ of_u.transpose(1, 2, 0)
        summed *= of_v.transpose(1, 2, 0)
        information: Floats = np.add.reduce(summed, 1).take(_UNFOLD, 1)
        return information

    def gradient(self, values: Floats) -> Floats:
        """See `Design`."""
        summed = values @ self.along_u.take(_ALONG_U, 0).transpose(1, 2, 0)
        summed *= self.along_v.take(_ALONG_V, 0).transpose(1, 2, 0)
        gradient: Floats = np.add.reduce(summed, 1)
        return gradient

    def leverage(self, cov: Floats) -> Floats:
        """See `Design`."""
        of_v, of_u = self.products()
        folded = cov[:, _PAIRS[0], _PAIRS[1]] * _MULTIPLICITY
        leverage: Floats = (of_v.transpose(1, 2, 0) * folded[:, None, :]) @ of_u.transpose(1, 0, 2)
        return leverage


class Sheared:
    """Ellipses at any angle: the centre along u moves by `SHEAR` pixels per row.

    Any ellipse is an upright one sheared along u. Rows are integrated by quadrature, columns exactly.

    Args:
        params: (n, 7) in the order BACKGROUND .. SHEAR; LN_SU is the width along u at a fixed row.
        shape: Height and width of the window.
    """

    def __init__(self, params: Floats, shape: tuple[int, int]) -> None:
        height, width = shape
        sd_v = np.exp(params[:, LN_SV, None, None])
        dv = np.arange(height)[:, None] + 0.5 * _NODES - params[:, V, None, None]
        z = dv / sd_v
        mass = 0.5 * _NODE_WEIGHTS * -_MINUS_INV_SQRT_2PI / sd_v * np.exp(-0.5 * z * z)
        shear = params[:, SHEAR, None, None]
        ln_su = np.broadcast_to(params[:, LN_SU, None, None], dv.shape)
        share, by_u, by_width = axis_profiles(params[:, U, None, None] + shear * dv, ln_su, width)
        along_v = (mass, mass, mass * z / sd_v, mass, mass * (z * z - 1.0), mass * dv)
        along_u = (share, by_u, share, by_width, share, by_u)
        parts = [np.einsum("nhk,nhkw->nhw", v, u) for v, u in zip(along_v, along_u, strict=True)]
        parts[2] -= shear * parts[1]
        self._dense: Floats = np.stack([np.ones_like(parts[0]), *parts], axis=1)

    @property
    def unit(self) -> Floats:
        """See `Design`."""
        unit: Floats = self._dense[:, FLUX]
        return unit

    def rows(self) -> Floats:
        """See `Design`."""
        return self._dense.reshape(*self._dense.shape[:2], -1)

    def information(self, weight: Floats) -> Floats:
        """See `Design`."""
        rows = self.rows()
        information: Floats = (rows * weight.reshape(len(rows), 1, -1)) @ rows.transpose(0, 2, 1)
        return information

    def gradient(self, values: Floats) -> Floats:
        """See `Design`."""
        gradient: Floats = np.einsum("nkhw,nhw->nk", self._dense, values)
        return gradient

    def leverage(self, cov: Floats) -> Floats:
        """See `Design`."""
        rows = self.rows()
        leverage: Floats = ((cov @ rows) * rows).sum(axis=1)
        return leverage.reshape(self.unit.shape)


def principal_axes(params: Floats) -> tuple[Floats, Floats]:
    """Short and long width in pixels (2,), their directions as columns (2, 2), of one spot (7,)."""
    su, sv = np.exp(params[LN_SU:SHEAR])
    mixed = params[SHEAR] * sv**2
    squares, axes = np.linalg.eigh([[su**2 + params[SHEAR] * mixed, mixed], [mixed, sv**2]])
    return np.sqrt(np.maximum(squares, 1e-6)), axes
