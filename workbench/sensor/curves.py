"""Spot curves: image position of each laser's spot over inverse depth, tabulated from the model in `optics`.

A ranger inverts these curves a thousand times a second, and one call of the model itself takes as long as
finding the spots. A table holds the coordinates of the spot and their derivatives by every parameter; the
interpolation depends on the lens model, see `workbench.sensor.interpolation`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray, IndexArray
from workbench.model.lens import PINHOLE
from workbench.optics.lens import LensModel
from workbench.optics.rays import RAY, Ray, spot_at_inverse_depth
from workbench.sensor.interpolation import image_line, interpolations

STEP = 1e-30
"""Step along the imaginary axis; its square vanishes beside any number of the model."""
AGREEMENT = 1e-11
"""Largest difference between table and model at the checks, relative to the largest value there."""
CONVERGED = 1e-9
"""Largest last step in the variable s of the interpolation; convergence is quadratic.

s = 1 is an angle of 45 degrees from the beam for a polynomial, of 90 degrees for a series.
"""
ITERATIONS = 20
"""Largest number of Gauss-Newton steps. Each is exact except for distortion; six usually reach rounding."""


class InvertedSpots(NamedTuple):
    """Depths of n spots; see `workbench.optics.triangulate.DepthEstimate`."""

    inverse_depth_per_mm: FloatArray
    """(n,) not positive where the spot lies at or beyond the laser's vanishing point; NaN where no depth
    within the valid domain of the lens model gives this spot."""
    across_sd: FloatArray
    """(n,) signed distance from the laser's line, in standard deviations of the spot."""
    z_sd_of_spot_mm: FloatArray
    """(n,) 1 sigma of the depth by the spot's noise."""
    dz: FloatArray
    """(n, C) derivatives of the depth by the parameters of the lens and of the ray."""
    dacross: FloatArray
    """(n, C) derivatives of `across_sd`."""


class SpotCurves:
    """Spot curves of lasers with `rays` (L, 4), and the `lens` in the order of its `model`.

    The lens is (C,) for all lasers, or (L, C) for lasers of different sensors.
    """

    def __init__(self, model: LensModel, lens: FloatArray, rays: FloatArray) -> None:
        self._columns = len(model.parameters) + len(RAY)
        for self._by in interpolations(model):
            nodes, terms = self._by.nodes, self._by.terms
            self._unit, self._at_infinity = self._by.scale(rays)
            at = self._by.argument(np.concatenate((nodes, self._by.checks)))
            values = _model(model, lens, rays, (at - self._at_infinity[:, None]) * self._unit[:, None])
            table = np.asarray(np.linalg.solve(self._by.basis(nodes), values[:, :terms]), float)
            difference = np.abs(self._by.basis(self._by.checks) @ table - values[:, terms:]).max(axis=(0, 1))
            if (difference <= AGREEMENT * np.abs(values).max(axis=(0, 1)) + 1e-300).all():
                break
        else:
            raise ValueError(f"lens {model.name}: no interpolation in inverse depth with up to {terms} terms")
        position = table[:, :, :2]
        self._position_and_slope = np.concatenate((position, self._by.derivative(position)), axis=2)
        self._derivatives = np.ascontiguousarray(table[:, :, 2:])
        fold = model.unfolded_radius(np.moveaxis(lens, -1, 0)[len(PINHOLE) :])
        self._unfolded = self._unfolded_between(rays, fold)
        """(L, 2) ends of s before the fold of the lens model."""
        self._starts = self._by.starts
        start = self._by.basis(self._starts) @ self._position_and_slope
        self._start_px = np.ascontiguousarray(start[:, :, :2])
        lower, upper = self._unfolded.T[:, :, None]
        self._may_start = (self._starts > lower) & (self._starts < upper)
        """(L, G) whether the start lies before the fold of the lens model."""

    def spots(self, laser: IndexArray, inverse_depth_per_mm: FloatArray) -> FloatArray:
        """(n, 2) pixel positions of points of the lasers `laser` (n,) at inverse depths (n,)."""
        return self._at(self._position_and_slope[laser, :, :2], self._variable(laser, inverse_depth_per_mm))

    def gradients(self, laser: IndexArray, inverse_depth_per_mm: FloatArray) -> FloatArray:
        """(n, 2, C + 1) derivatives of `spots` by the parameters of lens and ray, and by inverse depth."""
        s = self._variable(laser, inverse_depth_per_mm)
        own = self._at(self._derivatives[laser], s).reshape(len(laser), 2, self._columns)
        dw_ds = self._unit[laser] * self._by.argument_slope(s)
        slope = self._at(self._position_and_slope[laser], s)[:, 2:] / dw_ds[:, None]
        return np.concatenate((own, slope[:, :, None]), axis=2)

    def invert(self, laser: IndexArray, position_px: FloatArray, inverse_sd: FloatArray) -> InvertedSpots:
        """Maximum-likelihood inverse depths of n spots, by Gauss-Newton from the nearest start.

        The loop is compiled: a reading solves a few spots, one unknown each, in microseconds. A spot does not
        depend on the others.

        Args:
            laser: (n,) index of each spot's laser.
            position_px: (n, 2) finite.
            inverse_sd: (n, 2) 1 / sigma; 0 for a coordinate that was not measured.
        """
        from workbench.sensor.inversion_kernels import invert_spots  # loads the compiler

        found = invert_spots(
            np.ascontiguousarray(laser),
            np.ascontiguousarray(position_px),
            np.ascontiguousarray(inverse_sd),
            self._position_and_slope,
            self._derivatives,
            self._unit,
            self._at_infinity,
            self._unfolded,
            self._starts,
            self._start_px,
            self._may_start,
            self._by.is_series,
            ITERATIONS,
            CONVERGED,
        )
        return InvertedSpots(*found)

    def is_unfolded(self, laser: IndexArray, inverse_depth_per_mm: FloatArray) -> BoolArray:
        """(n,) whether points at inverse depths (n,) lie before the fold of the lens model."""
        s, (lower, upper) = self._variable(laser, inverse_depth_per_mm), self._unfolded[laser].T
        return np.asarray((s > lower) & (s < upper))

    def _variable(self, laser: IndexArray, inverse_depth_per_mm: FloatArray) -> FloatArray:
        return self._by.variable(inverse_depth_per_mm / self._unit[laser] + self._at_infinity[laser])

    def _unfolded_between(self, rays: FloatArray, radius: FloatArray) -> FloatArray:
        """(L, 2) s at the ends of each line's part within a radius, () or (L,), of the axis; NaN if none."""
        line = image_line(rays)
        with np.errstate(invalid="ignore"):
            half = np.sqrt(radius**2 - line.off_axis**2)
        ends = np.stack((-half, half), axis=1) - line.at_infinity[:, None]
        lasers = np.arange(len(rays))
        return np.stack([self._variable(lasers, end / line.baseline_mm) for end in ends.T], axis=1)

    def _at(self, table: FloatArray, s: FloatArray) -> FloatArray:
        """(n, m) values of tables (n, terms, m), each at its own s (n,)."""
        values: FloatArray = np.matmul(self._by.basis(s)[:, None, :], table)[:, 0]
        return values


def _model(model: LensModel, lens: FloatArray, rays: FloatArray, inverse_depth: FloatArray) -> FloatArray:
    """(L, n, 2 + 2 C) u, v, then the derivatives of u and of v by the C parameters of lens and ray.

    Complex-step derivatives, exact to rounding (W. Squire and G. Trapp, SIAM Rev. 40 (1998) 110). For so few
    points a compiled program takes far longer to load.
    """
    size = lens.shape[-1]
    inputs = np.concatenate((np.broadcast_to(lens, (len(rays), size)), rays), axis=1)
    columns = inputs.shape[1]
    steps = np.concatenate((np.zeros((1, columns)), np.eye(columns))) * (1j * STEP)
    stepped = np.moveaxis(inputs[:, None, None] + steps[:, None], -1, 0)  # (C, L, C + 1, 1)
    ours = stepped[:size], Ray(*stepped[size:])
    spots = np.stack(spot_at_inverse_depth(model, *ours, inverse_depth[:, None].astype(complex)))
    derivatives = (spots[:, :, 1:].imag / STEP).transpose(1, 3, 0, 2)  # of (2, L, C + 1, n)
    return np.concatenate(
        (spots[:, :, 0].real.transpose(1, 2, 0), derivatives.reshape(*derivatives.shape[:2], -1)), axis=2
    )
