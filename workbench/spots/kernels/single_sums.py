"""Sums over a window's pixels for a step of the fit, and the inverse of the information matrix, compiled."""

from __future__ import annotations

from typing import Final

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.spots.kernels.compiled import compiled
from workbench.spots.kernels.profiles import ALONG_U, ALONG_V

# Products of two of the four factors of a derivative, numbered.
_PAIR: Final = np.array([[0, 1, 2, 3], [1, 4, 5, 6], [2, 5, 7, 8], [3, 6, 8, 9]])
_PAIRS: Final = 10


@compiled
def invert(matrix: FloatArray, out: FloatArray) -> None:
    """Inverse of an information matrix (k, k) by Gauss-Jordan elimination with pivots; overwrites `matrix`.

    A ridge of 1e-10 keeps the inverse of a singular matrix finite.
    """
    k = matrix.shape[0]
    out[:] = 0.0
    for i in range(k):
        matrix[i, i] = matrix[i, i] * (1.0 + 1e-10) + 1e-12
        out[i, i] = 1.0
    for i in range(k):
        best = i
        for r in range(i + 1, k):
            if abs(matrix[r, i]) > abs(matrix[best, i]):
                best = r
        if best != i:
            for c in range(k):
                matrix[i, c], matrix[best, c] = matrix[best, c], matrix[i, c]
                out[i, c], out[best, c] = out[best, c], out[i, c]
        inverse = 1.0 / matrix[i, i]
        for c in range(k):
            matrix[i, c] *= inverse
            out[i, c] *= inverse
        for r in range(k):
            factor = matrix[r, i]
            if r != i and factor != 0.0:
                for c in range(k):
                    matrix[r, c] -= factor * matrix[i, c]
                    out[r, c] -= factor * out[i, c]


@compiled
def _summed_along_v(
    along_v: FloatArray, weight: FloatArray, residual: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Sums along v: weights times products of two profiles (10, width), weighted residuals (4, width)."""
    height, width = weight.shape
    squares, weighted = np.zeros((_PAIRS, width)), np.zeros((4, width))
    row = np.empty(width)
    for y in range(height):
        for x in range(width):
            row[x] = weight[y, x] * residual[y, x]
        for a in range(4):
            of_a = along_v[a, y]
            for x in range(width):
                weighted[a, x] += of_a * row[x]
            for b in range(a, 4):
                factor, p = of_a * along_v[b, y], _PAIR[a, b]
                for x in range(width):
                    squares[p, x] += factor * weight[y, x]
    return squares, weighted


@compiled
def separable_sums(
    along_u: FloatArray,
    along_v: FloatArray,
    weight: FloatArray,
    residual: FloatArray,
    information: FloatArray,
    gradient: FloatArray,
) -> None:
    """Sums over the pixels of an upright window: information (6, 6) and gradient (6,).

    Every derivative is a product of a profile along v and one along u. Sums are therefore taken along v first
    and along u then, without the full derivatives: a tenth of the work.
    """
    squares, weighted = _summed_along_v(along_v, weight, residual)
    for i in range(6):
        iu, iv = ALONG_U[i], ALONG_V[i]
        total = 0.0
        for x in range(along_u.shape[1]):
            total += along_u[iu, x] * weighted[iv, x]
        gradient[i] = total
        for j in range(i, 6):
            ju, p = ALONG_U[j], _PAIR[iv, ALONG_V[j]]
            total = 0.0
            for x in range(along_u.shape[1]):
                total += along_u[iu, x] * along_u[ju, x] * squares[p, x]
            information[i, j] = information[j, i] = total


@compiled
def dense_sums(
    rows: FloatArray, weight: FloatArray, residual: FloatArray, information: FloatArray, gradient: FloatArray
) -> None:
    """The same sums from full derivatives (k, height, width)."""
    k, height, width = rows.shape
    information[:], gradient[:] = 0.0, 0.0
    weighted = np.empty(width)
    for y in range(height):
        for i in range(k):
            total = 0.0
            for x in range(width):
                weighted[x] = rows[i, y, x] * weight[y, x]
                total += weighted[x] * residual[y, x]
            gradient[i] += total
            for j in range(i + 1):
                total = 0.0
                for x in range(width):
                    total += weighted[x] * rows[j, y, x]
                information[i, j] += total
    for i in range(k):
        for j in range(i):
            information[j, i] = information[i, j]


@compiled
def fill_leverage(rows: FloatArray, cov: FloatArray, out: FloatArray) -> None:
    """Fill (height, width): variance of the fitted pixel values, from that of the parameters (k, k)."""
    out[:] = 0.0
    for i in range(rows.shape[0]):
        for j in range(i + 1):
            factor = cov[i, j] if i == j else 2.0 * cov[i, j]
            for y in range(out.shape[0]):
                for x in range(out.shape[1]):
                    out[y, x] += factor * rows[i, y, x] * rows[j, y, x]
