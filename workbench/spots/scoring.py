"""Fisher scoring over all windows as one compiled program, and the model that it needs, row by row.

Order of the parameters as in `gaussian`. Derivation: docs/spots.md.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from workbench.spots.compiled import compiled
from workbench.spots.transfer import transfer_slope
from workbench.spots.types import Bools, Floats

_MAX_STEPS: Final = 20
_MAX_STEP: Final = np.array([math.inf, math.inf, 1.0, 1.0, 0.4, 0.4, 0.4])
# Of both logarithms of the width, and of the shear.
_LOWEST: Final = np.array([math.log(0.15), math.log(0.15), -3.0])
_HIGHEST: Final = np.array([math.log(12.0), math.log(12.0), 3.0])
# Where the steps stop. Near the end a step squares the error: one of 1 sd that is small against the spot too,
# or of 0.1 sd, leaves some hundredths of an sd once it is taken.
_TOLERANCE_SD: Final = 0.1
_SMALL: Final = 0.05
# One window that never converges must not keep the noise of the others from being measured.
_STEPS_TO_MEASURE: Final = 8
# After so many steps it is settled which pixels clip: a set that changes with every step never converges.
_STEPS_TO_SETTLE: Final = 6
# A pixel whose expected value is this near to clipping is left out whatever it reads, else noise would
# choose.
_CLIP_MARGIN_SD: Final = 2.0
_INV_SQRT_2: Final = 1.0 / math.sqrt(2.0)
_INV_SQRT_2PI: Final = 1.0 / math.sqrt(2.0 * math.pi)
# Three nodes of Gauss and Legendre integrate a pixel of the narrowest spot to 1e-4 of its peak.
_NODES: Final = 0.5 * np.polynomial.legendre.leggauss(3)[0]
_NODE_WEIGHTS: Final = 0.5 * np.polynomial.legendre.leggauss(3)[1]

# Which factor each parameter's derivative has along v and along u: 0 share, 1 by centre, 2 by width, 3
# constant.
_ALONG_V: Final = np.array([3, 0, 0, 1, 0, 2])
_ALONG_U: Final = np.array([3, 0, 1, 0, 2, 0])
# Products of two of the four factors, numbered.
_PAIR: Final = np.array([[0, 1, 2, 3], [1, 4, 5, 6], [2, 5, 7, 8], [3, 6, 8, 9]])
_PAIRS: Final = 10


@compiled
def profile(centre: float, ln_sd: float, out: Floats) -> None:
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
def upright_rows(params: Floats, rows: Floats) -> None:
    """Fill (6, height, width): derivatives of the pixels of one upright ellipse (6,)."""
    along_u, along_v = np.empty((4, rows.shape[2])), np.empty((4, rows.shape[1]))
    profile(params[2], params[4], along_u)
    profile(params[3], params[5], along_v)
    for k in range(6):
        of_u, of_v = along_u[_ALONG_U[k]], along_v[_ALONG_V[k]]
        for y in range(rows.shape[1]):
            for x in range(rows.shape[2]):
                rows[k, y, x] = of_v[y] * of_u[x]


@compiled
def sheared_rows(params: Floats, rows: Floats) -> None:
    """Fill (7, height, width): derivatives of one ellipse (7,) at any angle.

    Rows are integrated by quadrature, columns exactly.
    """
    sd_v, shear = math.exp(params[5]), params[6]
    along_u = np.empty((4, rows.shape[2]))
    rows[:] = 0.0
    rows[0] = 1.0
    for y in range(rows.shape[1]):
        for node in range(3):
            dv = y + _NODES[node] - params[3]
            z = dv / sd_v
            mass = _NODE_WEIGHTS[node] * _INV_SQRT_2PI / sd_v * math.exp(-0.5 * z * z)
            profile(params[2] + shear * dv, params[4], along_u)
            for x in range(rows.shape[2]):
                share, by_u = mass * along_u[0, x], mass * along_u[1, x]
                rows[1, y, x] += share
                rows[2, y, x] += by_u
                rows[3, y, x] += z / sd_v * share - shear * by_u
                rows[4, y, x] += mass * along_u[2, x]
                rows[5, y, x] += (z * z - 1.0) * share
                rows[6, y, x] += dv * by_u


@compiled
def invert(matrix: Floats, out: Floats) -> None:
    """Inverse of an information matrix (k, k), by elimination with pivots; `matrix` is used up.

    A ridge that only a singular one feels keeps the result finite.
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
def _summed_along_v(along_v: Floats, weight: Floats, residual: Floats) -> tuple[Floats, Floats]:
    """Columns' sums of weight times products of profiles (10, width), of weighted residuals (4, width)."""
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
def _separable_sums(
    along_u: Floats, along_v: Floats, weight: Floats, residual: Floats, information: Floats, gradient: Floats
) -> None:
    """Sums over the pixels of an upright window: information (6, 6) and gradient (6,).

    Every derivative is a product of a profile along v and one along u. Sums are therefore taken along v first
    and along u then, and the derivatives themselves are never written out: a tenth of the work.
    """
    squares, weighted = _summed_along_v(along_v, weight, residual)
    for i in range(6):
        iu, iv = _ALONG_U[i], _ALONG_V[i]
        total = 0.0
        for x in range(along_u.shape[1]):
            total += along_u[iu, x] * weighted[iv, x]
        gradient[i] = total
        for j in range(i, 6):
            ju, p = _ALONG_U[j], _PAIR[iv, _ALONG_V[j]]
            total = 0.0
            for x in range(along_u.shape[1]):
                total += along_u[iu, x] * along_u[ju, x] * squares[p, x]
            information[i, j] = information[j, i] = total


@compiled
def _dense_sums(
    rows: Floats, weight: Floats, residual: Floats, information: Floats, gradient: Floats
) -> None:
    """The same sums from derivatives (k, height, width) that are written out."""
    for i in range(rows.shape[0]):
        weighted = rows[i] * weight
        gradient[i] = (weighted * residual).sum()
        for j in range(i + 1):
            information[i, j] = information[j, i] = (weighted * rows[j]).sum()


@compiled
def _leverage(rows: Floats, cov: Floats, out: Floats) -> None:
    """Fill (height, width): variance of the fitted pixel values, from that of the parameters (k, k)."""
    out[:] = 0.0
    for i in range(rows.shape[0]):
        for j in range(i + 1):
            factor = cov[i, j] if i == j else 2.0 * cov[i, j]
            for y in range(out.shape[0]):
                for x in range(out.shape[1]):
                    out[y, x] += factor * rows[i, y, x] * rows[j, y, x]


@compiled
def _weigh(
    usable: Bools, clip: Floats, signal: Floats, background: float, floor: float, slope: float, out: Floats
) -> None:
    """Inverse of the variance that the model predicts, 0 where a pixel is not to be used."""
    for y in range(out.shape[0]):
        for x in range(out.shape[1]):
            variance = floor + slope * max(signal[y, x], 0.0)
            out[y, x] = usable[y, x] / variance
            if clip[y, x] < math.inf:
                room = clip[y, x] - signal[y, x] - background
                if not room > _CLIP_MARGIN_SD * math.sqrt(variance):
                    out[y, x] = 0.0


@compiled
def _moved(params: Floats, delta: Floats) -> None:
    """Step of one window, kept from jumping out of it; `params` is changed."""
    flux = max(abs(params[1]), 1e-9)
    for j in range(params.size):
        step = delta[j] / flux if j > 1 else delta[j]
        params[j] += min(max(step, -_MAX_STEP[j]), _MAX_STEP[j])
        if j > 3:
            params[j] = min(max(params[j], _LOWEST[j - 4]), _HIGHEST[j - 4])


@compiled
def _within(delta: Floats, cov: Floats, small: float) -> bool:
    """Whether a step is within 0.1 sd; or within 1 sd if that is small, too, DN."""
    for j in range(delta.size):
        variance = cov[j, j]
        limit = variance if small > 0.0 else 0.0
        if j > 1:
            limit = min(limit, small * small)
        if not delta[j] * delta[j] <= max(limit, _TOLERANCE_SD**2 * variance):
            return False
    return True


@compiled
def _evaluate(
    params: Floats,
    data: Floats,
    along_u: Floats,
    along_v: Floats,
    rows: Floats,
    signal: Floats,
    residual: Floats,
) -> None:
    """Fill profiles or derivatives of one window, its signal and residual, at `params`."""
    if params.size == 7:
        sheared_rows(params, rows)
        signal[:] = params[1] * rows[1]
    else:
        profile(params[2], params[4], along_u)
        profile(params[3], params[5], along_v)
        for y in range(signal.shape[0]):
            for x in range(signal.shape[1]):
                signal[y, x] = params[1] * along_v[0, y] * along_u[0, x]
    residual[:] = data - signal - params[0]


@compiled
def _solve(
    along_u: Floats,
    along_v: Floats,
    rows: Floats,
    weight: Floats,
    residual: Floats,
    cov: Floats,
    delta: Floats,
) -> None:
    """Fill the covariance (k, k) and the step (k,) of one window."""
    information, gradient = np.empty_like(cov), np.empty_like(delta)
    if delta.size == 7:
        _dense_sums(rows, weight, residual, information, gradient)
    else:
        _separable_sums(along_u, along_v, weight, residual, information, gradient)
    invert(information, cov)
    delta[:] = 0.0
    for a in range(delta.size):
        for b in range(delta.size):
            delta[a] += cov[a, b] * gradient[b]
    if not np.isfinite(delta.sum()):
        delta[:] = 0.0


@compiled
def _leverages(params: Floats, cov: Floats, data: Floats) -> Floats:
    """(n, height, width) leverage of every window's pixels."""
    leverage = np.empty_like(data)
    rows = np.empty((params.shape[1], data.shape[1], data.shape[2]))
    for i in range(len(params)):
        if params.shape[1] == 7:
            sheared_rows(params[i], rows)
        else:
            upright_rows(params[i], rows)
        _leverage(rows, cov[i], leverage[i])
    return leverage


@compiled
def _tilt(along_u: Floats, along_v: Floats, weight: Floats, residual: Floats) -> float:
    """Square of the score by the shear over its variance, of an upright window."""
    score = told = 0.0
    for y in range(weight.shape[0]):
        for x in range(weight.shape[1]):
            by_shear = along_v[1, y] * along_u[1, x]
            score += by_shear * weight[y, x] * residual[y, x]
            told += by_shear * by_shear * weight[y, x]
    return score * score / max(told, 1e-300)


@compiled
def _judge(signal: Floats, residual: Floats, weight: Floats, cov: Floats, flux: float, out: Floats) -> None:
    """Fill all but the last of a window's `Fit.judged`."""
    height, width = signal.shape
    worst = whole = inner = told = 0.0
    peak = -math.inf
    for y in range(height):
        for x in range(width):
            excess = residual[y, x] * residual[y, x] * weight[y, x]
            worst = max(worst, excess)
            peak = max(peak, signal[y, x])
            told += weight[y, x] * signal[y, x] * signal[y, x]
            whole += excess
            if 0 < y < height - 1 and 0 < x < width - 1:
                inner += excess
    out[0], out[1], out[2], out[3] = worst, (whole - inner) / (2 * (height + width - 2)), peak, told
    out[4] = math.sqrt(max(cov[1, 1], 0.0))
    out[5] = math.sqrt(max(cov[2, 2], 0.0)) / max(flux, 1e-12)
    out[6] = math.sqrt(max(cov[3, 3], 0.0)) / max(flux, 1e-12)


@compiled
def score(
    data: Floats,
    usable: Bools,
    clip: Floats,
    floor: Floats,
    guess: Floats,
    params: Floats,
    cov: Floats,
    signal: Floats,
    residual: Floats,
    weight: Floats,
    last: Bools,
    slope: Floats,
    judged: Floats,
) -> None:
    """Fit one spot per window, starting at `params`; from there on the arguments are filled: see `Fit`.

    Handing out an array that was made here would cost more than a step of one window.
    """
    n, k = params.shape
    delta = np.empty((n, k))
    slope[:] = guess
    along_u, along_v = np.empty((n, 4, data.shape[2])), np.empty((n, 4, data.shape[1]))
    rows = np.empty((n, k, data.shape[1], data.shape[2]))
    measured = False
    for step in range(_MAX_STEPS):
        for i in range(n):
            _evaluate(params[i], data[i], along_u[i], along_v[i], rows[i], signal[i], residual[i])
        again = True
        while again:
            there = True
            for i in range(n):
                _weigh(usable[i], clip[i], signal[i], params[i, 0], floor[i], slope[i], weight[i])
                _solve(along_u[i], along_v[i], rows[i], weight[i], residual[i], cov[i], delta[i])
                there = there and _within(delta[i], cov[i], 0.0)
            again = not measured and (there or step == _STEPS_TO_MEASURE)
            if again:
                leverage = _leverages(params, cov, data)
                slope[:] = transfer_slope(signal, residual, weight, leverage, floor, guess)
                measured = True
        if step == _STEPS_TO_SETTLE:
            usable = weight > 0.0
            clip = np.full_like(clip, math.inf)
        for i in range(n):
            last[i] = _within(delta[i], cov[i], max(_SMALL * abs(params[i, 1]), 1e-300))
            _moved(params[i], delta[i])
        if measured and last.all():
            break
    for i in range(n):
        _judge(signal[i], residual[i], weight[i], cov[i], params[i, 1], judged[i])
        judged[i, 7] = 0.0 if k == 7 else _tilt(along_u[i], along_v[i], weight[i], residual[i])
