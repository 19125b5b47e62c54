"""PSF as compiled loops: profiles along an axis, derivatives of an ellipse's pixels.

Order of the parameters as in `columns`. Derivation: docs/spots.md.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.spots.kernels.columns import LN_SU, LN_SV, SHEAR, U, V
from workbench.spots.kernels.compiled import compiled
from workbench.spots.kernels.gaussian import fill_gaussian

_INV_SQRT_2PI: Final = 1.0 / math.sqrt(2.0 * math.pi)
# Three Gauss-Legendre nodes integrate a pixel of the narrowest spot to 1e-4 of its peak.
_NODES: Final = 0.5 * np.polynomial.legendre.leggauss(3)[0]
_NODE_WEIGHTS: Final = 0.5 * np.polynomial.legendre.leggauss(3)[1]

# Factor of each parameter's derivative along v and along u: 0 share, 1 by centre, 2 by ln width, 3 constant.
ALONG_V: Final = np.array([3, 0, 0, 1, 0, 2])
ALONG_U: Final = np.array([3, 0, 1, 0, 2, 0])


@compiled
def profile(centre: float, ln_sd: float, out: FloatArray) -> None:
    """Fill (4, n): share of a unit Gaussian in each of n pixels, by centre, by ln of its width, and ones."""
    n, inverse = out.shape[1], math.exp(-ln_sd)
    z, density, below = np.empty(n + 1), np.empty(n + 1), np.empty(n + 1)
    for i in range(n + 1):
        z[i] = (i - 0.5 - centre) * inverse
    fill_gaussian(z, density, below)
    for i in range(n):
        out[0, i] = below[i + 1] - below[i]
        out[1, i] = (density[i] - density[i + 1]) * inverse
        out[2, i] = z[i] * density[i] - z[i + 1] * density[i + 1]
        out[3, i] = 1.0


@compiled
def upright_rows(params: FloatArray, rows: FloatArray) -> None:
    """Fill (6, height, width): derivatives of the pixels of one upright ellipse (6,)."""
    along_u, along_v = np.empty((4, rows.shape[2])), np.empty((4, rows.shape[1]))
    profile(params[U], params[LN_SU], along_u)
    profile(params[V], params[LN_SV], along_v)
    for k in range(6):
        of_u, of_v = along_u[ALONG_U[k]], along_v[ALONG_V[k]]
        for y in range(rows.shape[1]):
            for x in range(rows.shape[2]):
                rows[k, y, x] = of_v[y] * of_u[x]


@compiled
def sheared_rows(params: FloatArray, rows: FloatArray) -> None:
    """Fill (7, height, width): derivatives of one ellipse (7,) at any angle.

    Rows are integrated by quadrature, columns exactly.
    """
    sd_v, shear, inverse_u = math.exp(params[LN_SV]), params[SHEAR], math.exp(-params[LN_SU])
    width = rows.shape[2]
    edges = width + 1
    z, density, below = np.empty(3 * edges), np.empty(3 * edges), np.empty(3 * edges)
    rows[:] = 0.0
    rows[0] = 1.0
    for y in range(rows.shape[1]):
        for node in range(3):
            centre = params[U] + shear * (y + _NODES[node] - params[V])
            for x in range(edges):
                z[node * edges + x] = (x - 0.5 - centre) * inverse_u
        fill_gaussian(z, density, below)
        for node in range(3):
            dv = y + _NODES[node] - params[V]
            of_v = dv / sd_v
            mass = _NODE_WEIGHTS[node] * _INV_SQRT_2PI / sd_v * math.exp(-0.5 * of_v * of_v)
            for x in range(width):
                i = node * edges + x
                share, by_u = (
                    mass * (below[i + 1] - below[i]),
                    mass * (density[i] - density[i + 1]) * inverse_u,
                )
                rows[1, y, x] += share
                rows[2, y, x] += by_u
                rows[3, y, x] += of_v / sd_v * share - shear * by_u
                rows[4, y, x] += mass * (z[i] * density[i] - z[i + 1] * density[i + 1])
                rows[5, y, x] += (of_v * of_v - 1.0) * share
                rows[6, y, x] += dv * by_u
