"""Undistortion: the inverse of a lens model's projection, by Newton's method."""

from __future__ import annotations

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.optics.lens import LensModel

STEPS = 30
CONVERGED_PX = 1e-9
STEP = 1e-30
"""Step along the imaginary axis, for derivatives exact to rounding."""


def undistort(model: LensModel, lens: FloatArray, pixels: FloatArray) -> FloatArray:
    """(n, 2) undistorted x = X/Z, y = Y/Z of pixels (n, 2); NaN where no solution is found.

    Newton's method starts at the solution for the undistorted lens; on an increasing radial curve, convex or
    concave, it converges monotonically. Steps are limited to the radius of the model's fold: a root beyond it
    is the image point of another direction. The loop solves all pixels together, two unknowns each.

    Args:
        model: lens model.
        lens: (P,) parameters of the lens, in the model's order.
        pixels: (n, 2) u, v.
    """
    seen = np.asarray(pixels, float).reshape(-1, 2)
    fold = model.unfolded_radius(lens[3:])
    xy = _before_fold((seen - lens[1:3]) / lens[0], np.zeros(len(seen)), fold)
    with np.errstate(all="ignore"):  # pixels without a root
        for _ in range(STEPS):
            position, (by_x, by_y) = _project(model, lens, xy)
            miss = seen - position
            area = by_x[:, 0] * by_y[:, 1] - by_x[:, 1] * by_y[:, 0]
            if (np.abs(miss).max(initial=0.0) < CONVERGED_PX).all():
                break
            step_x = by_y[:, 1] * miss[:, 0] - by_y[:, 0] * miss[:, 1]
            step_y = by_x[:, 0] * miss[:, 1] - by_x[:, 1] * miss[:, 0]
            stepped = xy + np.column_stack((step_x, step_y)) / area[:, None]
            xy = _before_fold(stepped, np.hypot(*xy.T), fold)
        found = np.asarray((np.abs(miss) < 1e3 * CONVERGED_PX).all(axis=1))
    return np.where(found[:, None], xy, np.nan)


def _before_fold(xy: FloatArray, radius: FloatArray, fold: FloatArray) -> FloatArray:
    """(n, 2) points; those beyond the fold's radius are moved half way from `radius` (n,) to the fold."""
    reached = np.hypot(*xy.T)
    beyond = np.asarray(reached >= fold)
    share = np.where(beyond, 0.5 * (radius + fold) / np.where(beyond, reached, 1.0), 1.0)
    return np.asarray(xy * share[:, None])


def _project(
    model: LensModel, lens: FloatArray, xy: FloatArray
) -> tuple[FloatArray, tuple[FloatArray, FloatArray]]:
    """(n, 2) pixels, and their derivatives by x (n, 2) and by y (n, 2)."""
    numbers = lens[:, None].astype(complex)
    x, y = xy.T.astype(complex)
    by_x = np.stack(model.project(numbers, x + 1j * STEP, y), axis=1)
    by_y = np.stack(model.project(numbers, x, y + 1j * STEP), axis=1)
    return by_x.real, (by_x.imag / STEP, by_y.imag / STEP)
