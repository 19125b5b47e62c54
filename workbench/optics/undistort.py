"""Lines of sight of pixels: the inverse of a lens model's projection, by Newton's method."""

from __future__ import annotations

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.optics.lens import LensModel

STEPS = 30
CONVERGED_PX = 1e-9
STEP = 1e-30
"""Along the imaginary axis, for derivatives to the last digit."""


def undistort(model: LensModel, lens: FloatArray, pixels: FloatArray) -> FloatArray:
    """(n, 2) undistorted x = X/Z, y = Y/Z that a lens shows at pixels (n, 2); NaN where none is found.

    Newton's steps start at the undistorted lens's answer for small angles, and approach the root from one
    side on any radial curve that climbs, be it convex or concave. They stay nearer to the axis than the
    model's first fold: a root beyond it is another direction's image point.

    Args:
        model: kind of lens.
        lens: (P,) its parameters, in the model's order.
        pixels: u, v.
    """
    seen = np.asarray(pixels, float).reshape(-1, 2)
    fold = model.unfolded_radius(lens[3:])
    xy = _before_fold((seen - lens[1:3]) / lens[0], np.zeros(len(seen)), fold)
    with np.errstate(all="ignore"):  # of pixels without a root
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
    """(n, 2) points, those beyond the fold's radius moved to half way between `radius` (n,) and the fold."""
    reached = np.hypot(*xy.T)
    beyond = np.asarray(reached >= fold)
    share = np.where(beyond, 0.5 * (radius + fold) / np.where(beyond, reached, 1.0), 1.0)
    return np.asarray(xy * share[:, None])


def _project(
    model: LensModel, lens: FloatArray, xy: FloatArray
) -> tuple[FloatArray, tuple[FloatArray, FloatArray]]:
    """(n, 2) pixels, and (n, 2) their derivatives by x and by y."""
    numbers = lens[:, None].astype(complex)
    x, y = xy.T.astype(complex)
    by_x = np.stack(model.project(numbers, x + 1j * STEP, y), axis=1)
    by_y = np.stack(model.project(numbers, x, y + 1j * STEP), axis=1)
    return by_x.real, (by_x.imag / STEP, by_y.imag / STEP)
