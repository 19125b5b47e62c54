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

_INV_SQRT_2: Final = 1.0 / math.sqrt(2.0)
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
    sd = math.exp(ln_sd)
    z = (-0.5 - centre) / sd
    below, density = 0.5 * math.erf(z * _INV_SQRT_2), _INV_SQRT_2PI * math.exp(-0.5 * z * z)
    for i in range(out.shape[1]):
        next_z = (i + 0.5 - centre) / sd
        next_below = 0.5 * math.erf(next_z * _INV_SQRT_2)
        next_density = _INV_SQRT_2PI * math.exp(-0.5 * next_z * next_z)
        out[0, i] = next_below - below
        out[1, i] = (density - next_density) / sd
        out[2, i] = z * density - next_z * next_density
        out[3, i] = 1.0
        z, below, density = next_z, next_below, next_density


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
    sd_v, shear = math.exp(params[LN_SV]), params[SHEAR]
    along_u = np.empty((4, rows.shape[2]))
    rows[:] = 0.0
    rows[0] = 1.0
    for y in range(rows.shape[1]):
        for node in range(3):
            dv = y + _NODES[node] - params[V]
            z = dv / sd_v
            mass = _NODE_WEIGHTS[node] * _INV_SQRT_2PI / sd_v * math.exp(-0.5 * z * z)
            profile(params[U] + shear * dv, params[LN_SU], along_u)
            for x in range(rows.shape[2]):
                share, by_u = mass * along_u[0, x], mass * along_u[1, x]
                rows[1, y, x] += share
                rows[2, y, x] += by_u
                rows[3, y, x] += z / sd_v * share - shear * by_u
                rows[4, y, x] += mass * along_u[2, x]
                rows[5, y, x] += (z * z - 1.0) * share
                rows[6, y, x] += dv * by_u
