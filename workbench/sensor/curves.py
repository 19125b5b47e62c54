"""Each laser's spot in the image as a curve over inverse depth, tabulated from the model in `optics`.

With the lens of Brown and Conrady a spot's coordinates, and their derivatives by every parameter, are
polynomials of degree 7 in inverse depth: eight values of the model determine them, to the last digits. They
are what a ranger inverts a thousand times a second, where a call of the model itself costs as much as finding
the spots.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from workbench.model.arrays import FloatArray, IndexArray
from workbench.optics.lens import Lens
from workbench.optics.rays import Ray, spot_at_inverse_depth

TERMS = 8
"""Of a polynomial: r^6 times the coordinate is the highest power."""
PARAMETERS = 12
"""Of lens and ray."""
STEP = 1e-30
"""Along the imaginary axis: its square is nothing beside any number of the model."""
CHECKS = 5
AGREEMENT = 1e-11
"""Largest difference between polynomial and model at the checks, over the largest value there."""
CONVERGED = 1e-9
"""Of a step, in units where 1 is 45 degrees off the axis: steps shrink by their own square."""
ITERATIONS = 20
"""Gauss-Newton steps at most. Each is exact but for distortion; six reach the last digit of any good lens."""


class Inverted(NamedTuple):
    """n spots brought back to their rays; see `workbench.optics.triangulate.DepthEstimate`."""

    inverse_depth_per_mm: FloatArray
    """(n,) not positive where the spot lies at or beyond the image of the laser's point at infinity; not a
    number where no depth before the lens model folds over puts the laser's spot there."""
    across_sd: FloatArray
    """(n,) distance from the laser's line, signed, in standard deviations of the spot."""
    z_sd_of_spot_mm: FloatArray
    """(n,)"""
    dz: FloatArray
    """(n, 12) derivatives of depth by the lens's eight parameters and the ray's four."""
    dacross: FloatArray
    """(n, 12) derivatives of `across_sd`."""


class SpotCurves:
    """The curves of the lasers `rays` (L, 4) seen through `lens` (8,)."""

    def __init__(self, lens: FloatArray, rays: FloatArray) -> None:
        # At an inverse depth of 1 / baseline the spot lies 45 degrees off: outside most images, not by much.
        self._unit = 1.0 / np.maximum(np.hypot(rays[:, 0], rays[:, 1]), 1e-3)
        nodes = np.cos(np.pi * (np.arange(TERMS) + 0.5) / TERMS)
        between = np.cos(np.pi * (np.arange(CHECKS) + 0.3) / CHECKS)
        at = np.concatenate((nodes, between))
        values = _model(lens, rays, at * self._unit[:, None])  # (L, nodes, 2 * 13)
        self._table: FloatArray = np.asarray(np.linalg.solve(_powers(nodes), values[:, :TERMS]), float)
        """(L, TERMS, 2 * 13)"""
        difference = np.abs(_powers(between) @ self._table - values[:, TERMS:]).max(axis=(0, 1))
        if (difference > AGREEMENT * np.abs(values).max(axis=(0, 1)) + 1e-300).any():
            raise ValueError(f"the lens model is no polynomial of degree {TERMS - 1} in inverse depth")
        place = self._table[:, :, :2]
        slope = np.zeros_like(place)
        slope[:, :-1] = place[:, 1:] * np.arange(1, TERMS)[:, None]
        self._place_and_slope = np.concatenate((place, slope), axis=2)
        self._derivatives = self._table[:, :, 2:]

    def spots(self, laser: IndexArray, inverse_depth_per_mm: FloatArray) -> FloatArray:
        """(n, 2) pixels where points of the lasers `laser` (n,) at inverse depths (n,) appear."""
        return _at(self._table[laser, :, :2], inverse_depth_per_mm / self._unit[laser])

    def gradients(self, laser: IndexArray, inverse_depth_per_mm: FloatArray) -> FloatArray:
        """(n, 2, 13) derivatives of `spots` by the lens's eight parameters, the ray's four, inverse depth."""
        unit = self._unit[laser]
        t = inverse_depth_per_mm / unit
        own = _at(self._derivatives[laser], t).reshape(len(laser), 2, PARAMETERS)
        slope = _at(self._place_and_slope[laser], t)[:, 2:] / unit[:, None]
        return np.concatenate((own, slope[:, :, None]), axis=2)

    def invert(self, laser: IndexArray, position_px: FloatArray, inverse_sd: FloatArray) -> Inverted:
        """Maximum-likelihood inverse depths of n spots, by Gauss-Newton from infinity.

        Args:
            laser: (n,) index of each spot's laser.
            position_px: (n, 2) finite.
            inverse_sd: (n, 2) 1 / sigma; 0 for a coordinate that was not measured.
        """
        curve, unit = self._place_and_slope[laser], self._unit[laser]
        t = np.zeros(len(laser))
        for _ in range(ITERATIONS):
            seen = _at(curve, t)
            residual, slope = (seen[:, :2] - position_px) * inverse_sd, seen[:, 2:] * inverse_sd
            information = _dot(slope, slope)
            step = _dot(slope, residual) / information
            t = t - step
            if not (np.abs(step) > CONVERGED).any():
                break
        # The residual across the line no longer changes; the rest is evaluated once, at the end.
        by = _at(self._derivatives[laser], t).reshape(len(t), 2, PARAMETERS) * inverse_sd[:, :, None]
        found = (np.abs(step) <= CONVERGED) & (_dot(curve[:, 1, :2], seen[:, 2:]) > 0)  # still outwards
        w = np.where(found, t * unit, np.nan)
        root = np.sqrt(information)
        dz_dt = unit / w**2
        along = slope * (dz_dt / information)[:, None]
        across = np.stack((-slope[:, 1], slope[:, 0]), axis=1) / root[:, None]
        return Inverted(
            w,
            _dot(across, residual),
            dz_dt / root,
            (along[:, :, None] * by).sum(axis=1),
            (across[:, :, None] * by).sum(axis=1),
        )


def _powers(t: FloatArray) -> FloatArray:
    """(n, TERMS) t^0, t^1, ..."""
    powers = np.empty((len(t), TERMS))
    powers[:, 0], powers[:, 1:] = 1.0, t[:, None]
    return np.multiply.accumulate(powers, axis=1, out=powers)


def _at(table: FloatArray, t: FloatArray) -> FloatArray:
    """(n, m) polynomials (n, TERMS, m) at t (n,)."""
    return np.asarray(np.matmul(_powers(t)[:, None, :], table)[:, 0])


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """(n,) of rows of two."""
    return np.asarray(a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1])


def _model(lens: FloatArray, rays: FloatArray, inverse_depth: FloatArray) -> FloatArray:
    """(L, n, 2 * 13) u, v, then the derivatives of u and of v by lens and ray.

    By a step along the imaginary axis, exact to the last digit (W. Squire and G. Trapp, SIAM Rev. 40 (1998)
    110): the model is a polynomial. For so few points a compiled program takes far longer to load than this.
    """
    inputs = np.concatenate((np.broadcast_to(lens, (len(rays), len(lens))), rays), axis=1)
    steps = np.concatenate((np.zeros((1, PARAMETERS)), np.eye(PARAMETERS))) * (1j * STEP)
    stepped = np.moveaxis(inputs[:, None, None] + steps[:, None], -1, 0)  # (12, L, 13, 1)
    ours = Lens(*stepped[: len(lens)]), Ray(*stepped[len(lens) :])
    spots = np.stack(spot_at_inverse_depth(*ours, inverse_depth[:, None].astype(complex)))  # (2, L, 13, n)
    derivatives = (spots[:, :, 1:].imag / STEP).transpose(1, 3, 0, 2)
    return np.concatenate(
        (spots[:, :, 0].real.transpose(1, 2, 0), derivatives.reshape(*derivatives.shape[:2], -1)), axis=2
    )
