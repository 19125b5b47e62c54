"""Compiled inversion of spot curves. Imported only inside functions, because numba takes long to load.

A reading ranges a handful of spots. With numpy that is a hundred calls of a microsecond each; compiled it
takes a few microseconds.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray, IndexArray
from workbench.spots.kernels.compiled import compiled

_QUARTER_TURN_RAD: Final = 0.5 * math.pi


@compiled
def _fill_basis(s: float, is_series: bool, out: FloatArray) -> None:
    """Fill the terms of an interpolation at s: powers, or Chebyshev polynomials."""
    if is_series:
        angle = math.acos(s)
        for k in range(out.size):
            out[k] = math.cos(k * angle)
        return
    out[0] = 1.0
    for k in range(1, out.size):
        out[k] = out[k - 1] * s


@compiled
def _evaluate(table: FloatArray, basis: FloatArray, out: FloatArray) -> None:
    """Fill the values (m,) of a table (terms, m)."""
    out[:] = 0.0
    for k in range(basis.size):
        for j in range(out.size):
            out[j] += basis[k] * table[k, j]


@compiled
def _start(
    starts: FloatArray,
    start_px: FloatArray,
    may_start: BoolArray,
    position: FloatArray,
    inverse_sd: FloatArray,
) -> float:
    """Start nearest to a spot (2,); arguments as in `invert_spots`, of one laser."""
    if starts.size == 1:
        return 0.0
    nearest, best = math.inf, 0
    for g in range(starts.size):
        away_u = (start_px[g, 0] - position[0]) * inverse_sd[0]
        away_v = (start_px[g, 1] - position[1]) * inverse_sd[1]
        away2 = away_u * away_u + away_v * away_v
        if may_start[g] and away2 < nearest:
            nearest, best = away2, g
    start: float = starts[best]
    return start


@compiled
def invert_spots(
    laser: IndexArray,
    position_px: FloatArray,
    inverse_sd: FloatArray,
    position_and_slope: FloatArray,
    derivatives: FloatArray,
    unit: FloatArray,
    at_infinity: FloatArray,
    unfolded: FloatArray,
    starts: FloatArray,
    start_px: FloatArray,
    may_start: BoolArray,
    is_series: bool,
    steps: int,
    tolerance: float,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Maximum-likelihood inverse depths of n spots; see `curves.SpotCurves.invert`.

    Args:
        laser: (n,) index of each spot's laser.
        position_px: (n, 2) finite.
        inverse_sd: (n, 2) 1 / sigma; 0 for a coordinate that was not measured.
        position_and_slope: (L, terms, 4) table of u, v and their derivatives by s.
        derivatives: (L, terms, 2 C) table of the derivatives of u, then of v, by the parameters.
        unit: (L,) unit of inverse depth, 1/mm.
        at_infinity: (L,) argument at infinity.
        unfolded: (L, 2) ends of s before the fold of the lens model.
        starts: (G,) starting values.
        start_px: (L, G, 2) positions there.
        may_start: (L, G) whether they lie before the fold.
        is_series: Chebyshev series in an angle, or powers.
        steps: largest number of steps.
        tolerance: largest last step.

    Returns:
        as in `curves.InvertedSpots`.
    """
    n, columns = len(laser), derivatives.shape[2] // 2
    w, across_sd, z_sd = np.empty(n), np.empty(n), np.empty(n)
    dz, dacross = np.empty((n, columns)), np.empty((n, columns))
    basis, seen, own = np.empty(position_and_slope.shape[1]), np.empty(4), np.empty(2 * columns)
    for i in range(n):
        of, by_u, by_v = laser[i], inverse_sd[i, 0], inverse_sd[i, 1]
        s = _start(starts, start_px[of], may_start[of], position_px[i], inverse_sd[i])
        searching = True
        for step in range(steps + 1):
            _fill_basis(s, is_series, basis)
            _evaluate(position_and_slope[of], basis, seen)
            residual_u, residual_v = (
                (seen[0] - position_px[i, 0]) * by_u,
                (seen[1] - position_px[i, 1]) * by_v,
            )
            slope_u, slope_v = seen[2] * by_u, seen[3] * by_v
            information = slope_u * slope_u + slope_v * slope_v
            if step == steps or not searching:
                break
            change = (slope_u * residual_u + slope_v * residual_v) / information
            s -= change
            if is_series:
                s = min(max(s, -1.0), 1.0)
            searching = abs(change) > tolerance
        _evaluate(derivatives[of], basis, own)
        argument = math.tan(_QUARTER_TURN_RAD * s) if is_series else s
        by_s = _QUARTER_TURN_RAD * (1.0 + argument * argument) if is_series else 1.0
        found = not searching and unfolded[of, 0] < s < unfolded[of, 1]
        w[i] = (argument - at_infinity[of]) * unit[of] if found else math.nan
        dz_ds, root = unit[of] * by_s / (w[i] * w[i]), math.sqrt(information)
        z_sd[i] = dz_ds / root
        across_u, across_v = -slope_v / root, slope_u / root
        across_sd[i] = across_u * residual_u + across_v * residual_v
        along_u, along_v = slope_u * dz_ds / information * by_u, slope_v * dz_ds / information * by_v
        for c in range(columns):
            dz[i, c] = along_u * own[c] + along_v * own[columns + c]
            dacross[i, c] = across_u * by_u * own[c] + across_v * by_v * own[columns + c]
    return w, across_sd, z_sd, dz, dacross


@compiled
def propagate(
    laser: IndexArray,
    dz: FloatArray,
    across_sd: FloatArray,
    dacross: FloatArray,
    own: IndexArray,
    offset: int,
    covariance: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Derivatives of n ranges by all parameters (n, P), and distances from the laser's line (n,).

    Args:
        laser: (n,) index of each spot's laser.
        dz: (n, C) as in `curves.InvertedSpots`, like the next two.
        across_sd: (n,)
        dacross: (n, C)
        own: (L, C) indices of the parameters of the lens and of each laser's ray.
        offset: index of the parameter `offset_mm`.
        covariance: (P, P) of the parameters.
    """
    n, columns = dz.shape
    gradient, misfit_sd = np.zeros((n, len(covariance))), np.empty(n)
    for i in range(n):
        mine = own[laser[i]]
        variance = 1.0
        for a in range(columns):
            gradient[i, mine[a]] = dz[i, a]
            row = covariance[mine[a]]
            total = 0.0
            for b in range(columns):
                total += row[mine[b]] * dacross[i, b]
            variance += dacross[i, a] * total
        gradient[i, offset] = -1.0
        misfit_sd[i] = abs(across_sd[i]) / math.sqrt(variance)
    return gradient, misfit_sd
