"""PSF of a spot: a Gaussian integrated over square pixels, and its derivatives, for many windows.

The origin is the centre of the window's first pixel. Derivatives by position and width are per unit flux,
so that the information matrix stays regular at zero flux. Derivation: docs/spots.md.
"""

from __future__ import annotations

import math

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.spots.kernels.columns import LN_SU, LN_SV, SHEAR
from workbench.spots.kernels.profiles import sheared_rows, upright_rows


def derivatives(params: FloatArray, shape: tuple[int, int]) -> FloatArray:
    """(n, k, height, width) derivatives of the pixels of n windows; `[:, FLUX]` is the spot for a flux of 1.

    Args:
        params: (n, 6) BACKGROUND to LN_SV for ellipses with axes along rows and columns, or (n, 7)
            BACKGROUND to SHEAR for any angle. Any ellipse is an upright one sheared along u: its centre
            moves by SHEAR pixels per row. LN_SU is then the width along u at a fixed row.
        shape: Height and width of the window.
    """
    rows = np.empty((*params.shape, *shape))
    fill = upright_rows if params.shape[1] == SHEAR else sheared_rows
    for one, out in zip(params, rows, strict=True):
        fill(one, out)
    return rows


def principal_axes(params: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Short and long width (2,) in px, and their directions as columns (2, 2), of one spot (6,) or (7,)."""
    var_u, var_v = math.exp(2.0 * params[LN_SU]), math.exp(2.0 * params[LN_SV])
    shear = float(params[SHEAR]) if params.size > SHEAR else 0.0
    mixed, var_u = shear * var_v, var_u + shear**2 * var_v
    half_difference = math.hypot(0.5 * (var_u - var_v), mixed)
    variances = 0.5 * (var_u + var_v) + np.array([-half_difference, half_difference])
    angle = 0.5 * math.atan2(2.0 * mixed, var_u - var_v)
    cos, sin = math.cos(angle), math.sin(angle)
    return np.sqrt(np.maximum(variances, 1e-6)), np.array([[-sin, cos], [cos, sin]])
