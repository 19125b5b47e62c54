"""Lens: projection by OpenCV (pinhole with distortion, or fisheye), inverse by Newton's method."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import cv2
import numpy as np

from workbench.emulator.truth import Truth
from workbench.model.arrays import FloatArray
from workbench.model.errors import BadInputError
from workbench.model.lens import COEFFICIENTS, LensName

NEWTON_STEPS = 30
NEWTON_PX = 1e-7
SIGHT_STEP_PX = 8
ZERO = np.zeros(3)
FORWARD: dict[LensName, tuple[Callable[..., Any], int]] = {
    "plumb_bob": (cv2.projectPoints, 3),
    "equidistant": (cv2.fisheye.projectPoints, 11),
}
"""OpenCV's projection, and the first column of the translation in its Jacobian."""


@dataclass(frozen=True)
class LinesOfSight:
    """Lines of sight of pixels: x = X/Z, y = Y/Z, and area = |d(x, y)/d(u, v)|."""

    x: FloatArray
    y: FloatArray
    area: FloatArray


class Drift(NamedTuple):
    """State of the camera at one frame against its truth."""

    f_scale: float = 1.0
    u_px: float = 0.0
    v_px: float = 0.0
    """Shift of the image."""


STEADY = Drift()


class Lens:
    """Lens in OpenCV's camera frame; the centre of the top-left pixel is (0, 0)."""

    def __init__(self, truth: Truth, drift: Drift = STEADY) -> None:
        f, cx, cy = truth.f_px * drift.f_scale, truth.cx_px + drift.u_px, truth.cy_px + drift.v_px
        self._matrix = np.array([[f, 0, cx], [0, f, cy], [0, 0, 1]])
        self._coefficients = {name: getattr(truth, name) for name in COEFFICIENTS[truth.lens]}
        self._forward = FORWARD[truth.lens]

    def project(self, points_mm: FloatArray) -> FloatArray:
        """Pixels (n, 2) of points (n, 3), mm, all in front of the camera."""
        return self._derived(points_mm)[0]

    def back_project(self, u_px: FloatArray, v_px: FloatArray) -> LinesOfSight:
        """Lines of sight of pixels (n,), by Newton's method on OpenCV's projection.

        OpenCV's own inverse is a fixed-point iteration, which may diverge for strong distortion. Newton's
        method, started at the undistorted pixel, converges on any increasing radial curve that is convex or
        concave.

        Raises:
            BadInputError: some pixels have no line of sight, because the lens folds.
        """
        target = np.stack([u_px, v_px], axis=1)
        xy = (target - self._matrix[:2, 2]) / self._matrix[0, 0]
        for _ in range(NEWTON_STEPS):
            du, dv, jacobian = self._miss(xy, target)
            (a, b), (c, d) = jacobian
            area = a * d - b * c
            if np.any(area <= 0):
                break
            if max(np.abs(du).max(), np.abs(dv).max()) < NEWTON_PX:
                return LinesOfSight(xy[:, 0], xy[:, 1], 1 / area)
            xy = xy + np.stack([d * du - b * dv, a * dv - c * du], axis=1) / area[:, None]
        raise BadInputError(
            "emulated lens: expected distortion with one line of sight for every pixel of the image, got"
            f" {', '.join(self._coefficients)} = {list(self._coefficients.values())}; check the rig's camera"
            " and emulator.truth"
        )

    def back_project_grid(
        self, u_px: FloatArray, v_px: FloatArray, samples_u: FloatArray, samples_v: FloatArray
    ) -> LinesOfSight:
        """Lines of sight (rows of v, columns of u) on a fine grid, by cubic splines between whole pixels.

        `u_px`, `v_px` are whole pixels around the samples. Distortion varies over hundreds of pixels: the
        error of the spline, of fourth order in 1 / f, is below 1e-9 px.
        """
        uu, vv = np.meshgrid(u_px, v_px)
        nodes = self.back_project(uu.ravel(), vv.ravel())
        x, y, area = (
            _spline(v_px, u_px, values.reshape(uu.shape))(samples_v, samples_u)
            for values in (nodes.x, nodes.y, nodes.area)
        )
        return LinesOfSight(x, y, area)

    def _miss(self, xy: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Target - projection in u and v, and the Jacobian d(u, v)/d(x, y) of the projection, (2, 2, n)."""
        # At depth 1 a translation equals a step of (x, y).
        pixels, by_translation = self._derived(np.column_stack([xy, np.ones(len(xy))]))
        miss = target - pixels
        return miss[:, 0], miss[:, 1], by_translation[:, :, :2].transpose(1, 2, 0)

    def _derived(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Pixels (n, 2) of points (n, 3), with derivatives (n, 2, 3) by a translation of the points."""
        coefficients = np.array(list(self._coefficients.values()))
        forward, column = self._forward
        pixels, jacobian = forward(points.reshape(-1, 1, 3), ZERO, ZERO, self._matrix, coefficients)
        derivatives = np.asarray(jacobian, dtype=np.float64).reshape(len(points), 2, -1)
        found = np.asarray(pixels, dtype=np.float64).reshape(-1, 2)
        return found, derivatives[:, :, column : column + 3]


class SightMap:
    """Lines of sight of all pixels of an image by splines, for many small grids.

    The nodes are about `SIGHT_STEP_PX` apart. The error of the spline is of fourth order in that step over
    the focal length: below 1e-4 px for the lenses of the rig files.
    """

    def __init__(self, lens: Lens, width: int, height: int) -> None:
        u, v = (np.linspace(-2, side + 1, side // SIGHT_STEP_PX + 2) for side in (width, height))
        uu, vv = np.meshgrid(u, v)
        nodes = lens.back_project(uu.ravel(), vv.ravel())
        self._splines = [_spline(v, u, values.reshape(uu.shape)) for values in (nodes.x, nodes.y, nodes.area)]

    def grid(self, samples_u: FloatArray, samples_v: FloatArray) -> LinesOfSight:
        """Lines of sight (rows of v, columns of u) on a grid."""
        return LinesOfSight(*(spline(samples_v, samples_u) for spline in self._splines))


def _spline(v_px: FloatArray, u_px: FloatArray, values: FloatArray) -> Callable[..., FloatArray]:
    """Cubic spline through values (rows of v, columns of u) at the nodes of a grid."""
    from scipy.interpolate import RectBivariateSpline  # takes long to load; a check renders nothing

    spline: Callable[..., FloatArray] = RectBivariateSpline(v_px, u_px, values)
    return spline
