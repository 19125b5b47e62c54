"""Sums over a window's pixels for a step of a joint fit, compiled.

The parameters of such a fit, in order: background, ln of both widths, then flux, u and v of each spot.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from workbench.model.arrays import FloatArray, IndexArray
from workbench.spots.kernels.columns import FLUX, LN_SU, LN_SV, U, V
from workbench.spots.kernels.compiled import compiled
from workbench.spots.kernels.profiles import ALONG_U, ALONG_V, profile

SHARED: Final = 3
"""Parameters before those of the single spots: background and both widths."""
OWN: Final = 3
"""Parameters of each spot: flux, u, v."""
# Reach along an axis, in widths; a millionth of a spot's light lies beyond.
_REACH_WIDTHS: Final = 5.0


@compiled
def profiles(params: FloatArray, along_u: FloatArray, along_v: FloatArray, box: IndexArray) -> None:
    """Fill the profiles (k, 4, width) and (k, 4, height), and the boxes (k, 4) of the spots' light.

    A box holds the first column, the end of the columns, the first row, the end of the rows.
    """
    for i in range(len(params)):
        profile(params[i, U], params[i, LN_SU], along_u[i])
        profile(params[i, V], params[i, LN_SV], along_v[i])
        for j, size in enumerate((along_u.shape[2], along_v.shape[2])):
            reach = _REACH_WIDTHS * math.exp(params[i, LN_SU + j]) + 0.5
            box[i, 2 * j] = min(max(math.floor(params[i, U + j] - reach), 0), size)
            box[i, 2 * j + 1] = min(max(math.ceil(params[i, U + j] + reach) + 1, 0), size)


@compiled
def _fit_index(i: int, p: int) -> int:
    """Index among the parameters of the fit of parameter p (FLUX to LN_SV in `columns`) of spot i."""
    return SHARED + OWN * i + p - 1 if p <= OWN else p - OWN


@compiled
def _overlap(box: IndexArray, i: int, j: int) -> tuple[int, int, int, int]:
    """Intersection of the boxes of two spots: first column, end, first row, end."""
    return (
        max(box[i, 0], box[j, 0]),
        min(box[i, 1], box[j, 1]),
        max(box[i, 2], box[j, 2]),
        min(box[i, 3], box[j, 3]),
    )


@compiled
def sums_alone(
    params: FloatArray,
    along_u: FloatArray,
    along_v: FloatArray,
    box: IndexArray,
    weight: FloatArray,
    residual: FloatArray,
    information: FloatArray,
    gradient: FloatArray,
) -> None:
    """Fill the gradient (m,) and the background's row and column of the information (m, m); the rest is 0."""
    weighted = weight * residual
    information[:], gradient[:] = 0.0, 0.0
    information[0, 0], gradient[0] = weight.sum(), weighted.sum()
    weight_sums, residual_sums = np.empty((3, weight.shape[1])), np.empty((3, weight.shape[1]))
    for i in range(len(params)):
        first, end = box[i, 0], box[i, 1]
        weight_sums[:], residual_sums[:] = 0.0, 0.0
        for y in range(box[i, 2], box[i, 3]):
            for a in range(3):
                factor = along_v[i, a, y]
                for x in range(first, end):
                    weight_sums[a, x] += factor * weight[y, x]
                    residual_sums[a, x] += factor * weighted[y, x]
        for p in range(1, 6):
            of_u, scale = along_u[i, ALONG_U[p]], 1.0 if p == 1 else params[i, FLUX]
            information_sum = gradient_sum = 0.0
            for x in range(first, end):
                information_sum += of_u[x] * weight_sums[ALONG_V[p], x]
                gradient_sum += of_u[x] * residual_sums[ALONG_V[p], x]
            information[0, _fit_index(i, p)] += scale * information_sum
            gradient[_fit_index(i, p)] += scale * gradient_sum
    information[1:, 0] = information[0, 1:]


@compiled
def add_pairs(
    params: FloatArray,
    along_u: FloatArray,
    along_v: FloatArray,
    box: IndexArray,
    weight: FloatArray,
    information: FloatArray,
) -> None:
    """Add the terms of every spot and of every two overlapping spots to the information (m, m).

    Sums are taken along v first, as in `single_sums.separable_sums`.
    """
    products = np.empty((3, 3, weight.shape[1]))
    for i in range(len(params)):
        for j in range(i + 1):
            first, end, top, bottom = _overlap(box, i, j)
            if first >= end or top >= bottom:
                continue
            products[:] = 0.0
            for y in range(top, bottom):
                for a in range(3):
                    for b in range(3):
                        factor, sums = along_v[i, a, y] * along_v[j, b, y], products[a, b]
                        for x in range(first, end):
                            sums[x] += factor * weight[y, x]
            for p in range(1, 6):
                for q in range(1, 6):
                    of_i, of_j = along_u[i, ALONG_U[p]], along_u[j, ALONG_U[q]]
                    sums = products[ALONG_V[p], ALONG_V[q]]
                    total = 0.0
                    for x in range(first, end):
                        total += of_i[x] * of_j[x] * sums[x]
                    total *= (1.0 if p == 1 else params[i, FLUX]) * (1.0 if q == 1 else params[j, 1])
                    information[_fit_index(i, p), _fit_index(j, q)] += total
                    if i != j:
                        information[_fit_index(j, q), _fit_index(i, p)] += total


@compiled
def leverages(
    params: FloatArray,
    along_u: FloatArray,
    along_v: FloatArray,
    box: IndexArray,
    cov: FloatArray,
    out: FloatArray,
) -> None:
    """Fill (height, width): variance of the fitted pixel values, DN^2."""
    out[:] = cov[0, 0]
    mixed = np.empty((3, 3))
    for i in range(len(params)):
        for y in range(box[i, 2], box[i, 3]):
            for p in range(1, 6):
                factor = 2.0 * cov[0, _fit_index(i, p)] * (1.0 if p == 1 else params[i, FLUX])
                factor *= along_v[i, ALONG_V[p], y]
                for x in range(box[i, 0], box[i, 1]):
                    out[y, x] += factor * along_u[i, ALONG_U[p], x]
        for j in range(i + 1):
            first, end, top, bottom = _overlap(box, i, j)
            for y in range(top, bottom):
                mixed[:] = 0.0
                for p in range(1, 6):
                    for q in range(1, 6):
                        factor = (1.0 if p == 1 else params[i, FLUX]) * (1.0 if q == 1 else params[j, 1])
                        factor *= along_v[i, ALONG_V[p], y] * along_v[j, ALONG_V[q], y]
                        mixed[ALONG_U[p], ALONG_U[q]] += factor * cov[_fit_index(i, p), _fit_index(j, q)]
                if i != j:
                    mixed *= 2.0
                for a in range(3):
                    share, centre, width = mixed[a, 0], mixed[a, 1], mixed[a, 2]
                    for x in range(first, end):
                        of_j = share * along_u[j, 0, x] + centre * along_u[j, 1, x] + width * along_u[j, 2, x]
                        out[y, x] += along_u[i, a, x] * of_j
