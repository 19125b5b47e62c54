"""The lens: OpenCV's pinhole with Brown-Conrady distortion, forward by OpenCV, backward by Newton."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from workbench.emulator.truth import Truth

Array = NDArray[np.float64]
NEWTON_STEPS = 12
ZERO = np.zeros(3)


@dataclass(frozen=True)
class BackProjection:
    """Where pixels look: x = X/Z and y = Y/Z of their lines of sight, and the solid angle that they cover.

    `area` is |d(x, y)/d(u, v)|, NaN where no line of sight leads to the pixel.
    """

    x: Array
    y: Array
    area: Array


class Lens:
    """Camera frame of OpenCV; the centre of the top-left pixel is (0, 0)."""

    def __init__(self, truth: Truth, f_scale: float = 1.0) -> None:
        f = truth.f_px * f_scale
        self._matrix = np.array([[f, 0, truth.cx_px], [0, f, truth.cy_px], [0, 0, 1]])
        self._distortion = np.array([truth.k1, truth.k2, truth.p1, truth.p2, truth.k3])

    def project(self, points_mm: Array) -> Array:
        """Pixels (n, 2) of points (n, 3), mm, all in front of the camera."""
        pixels, _ = cv2.projectPoints(points_mm.reshape(-1, 1, 3), ZERO, ZERO, self._matrix, self._distortion)
        return np.asarray(pixels, dtype=np.float64).reshape(-1, 2)

    def back_project(self, u_px: Array, v_px: Array) -> BackProjection:
        """Lines of sight of pixels (n,), by Newton's method on OpenCV's projection.

        OpenCV's own inverse is a fixed-point iteration that need not converge for a strongly curved lens.
        Started at the undistorted pixel, Newton's steps approach the root from one side on any radial curve
        that climbs, be it convex or concave.
        """
        target = np.stack([u_px, v_px], axis=1)
        xy = (target - self._matrix[:2, 2]) / self._matrix[0, 0]
        for _ in range(NEWTON_STEPS):
            residual, (a, b, c, d) = self._residual(xy, target)
            det = a * d - b * c
            step = np.stack(
                [d * residual[:, 0] - b * residual[:, 1], a * residual[:, 1] - c * residual[:, 0]]
            )
            with np.errstate(divide="ignore", invalid="ignore"):
                xy = xy + (step / det).T
            if not np.nanmax(np.abs(residual), initial=0.0) > 1e-7:
                break
        seen = (np.abs(residual).max(axis=1) < 1e-3) & (det > 0)
        return BackProjection(xy[:, 0], xy[:, 1], np.where(seen, 1 / np.where(seen, det, 1), np.nan))

    def _residual(self, xy: Array, target: Array) -> tuple[Array, tuple[Array, Array, Array, Array]]:
        """Target minus projection, and the projection's Jacobian [[a, b], [c, d]] = d(u, v)/d(x, y)."""
        points = np.column_stack([xy, np.ones(len(xy))]).reshape(-1, 1, 3)
        pixels, jacobian = cv2.projectPoints(points, ZERO, ZERO, self._matrix, self._distortion)
        # OpenCV's columns are rotation (3), translation (3), ...: at depth 1 a translation is a step of (x, y).
        a, b = jacobian[0::2, 3], jacobian[0::2, 4]
        c, d = jacobian[1::2, 3], jacobian[1::2, 4]
        return target - pixels.reshape(-1, 2), (a, b, c, d)
