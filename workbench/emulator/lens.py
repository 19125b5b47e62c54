"""The lens: OpenCV's pinhole with Brown-Conrady distortion, forward by OpenCV, backward by Newton."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.interpolate import RectBivariateSpline

from workbench.emulator.truth import Truth
from workbench.model.arrays import FloatArray
from workbench.model.errors import BadInputError

NEWTON_STEPS = 30
NEWTON_PX = 1e-7
ZERO = np.zeros(3)


@dataclass(frozen=True)
class LinesOfSight:
    """Where pixels look: x = X/Z and y = Y/Z of their lines of sight, and area = |d(x, y)/d(u, v)|."""

    x: FloatArray
    y: FloatArray
    area: FloatArray


class Lens:
    """Camera frame of OpenCV; the centre of the top-left pixel is (0, 0)."""

    def __init__(self, truth: Truth, f_scale: float = 1.0) -> None:
        f = truth.f_px * f_scale
        self._matrix = np.array([[f, 0, truth.cx_px], [0, f, truth.cy_px], [0, 0, 1]])
        self._distortion = np.array([truth.k1, truth.k2, truth.p1, truth.p2, truth.k3])

    def project(self, points_mm: FloatArray) -> FloatArray:
        """Pixels (n, 2) of points (n, 3), mm, all in front of the camera."""
        pixels, _ = cv2.projectPoints(points_mm.reshape(-1, 1, 3), ZERO, ZERO, self._matrix, self._distortion)
        return np.asarray(pixels, dtype=np.float64).reshape(-1, 2)

    def back_project(self, u_px: FloatArray, v_px: FloatArray) -> LinesOfSight:
        """Lines of sight of pixels (n,), by Newton's method on OpenCV's projection.

        OpenCV's own inverse is a fixed-point iteration that need not converge for a strongly curved lens.
        Started at the undistorted pixel, Newton's steps approach the root from one side on any radial curve
        that climbs, be it convex or concave.

        Raises:
            BadInputError: no line of sight leads to some of the pixels: the lens folds.
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
            f" k1, k2, p1, p2, k3 = {self._distortion.tolist()}; check the rig's camera and emulator.truth"
        )

    def back_project_grid(
        self, u_px: FloatArray, v_px: FloatArray, samples_u: FloatArray, samples_v: FloatArray
    ) -> LinesOfSight:
        """Lines of sight (rows of v, columns of u) on a fine grid, by cubic splines between whole pixels.

        `u_px`, `v_px` are whole pixels around the samples. A lens bends over hundreds of pixels: the
        spline's error, of fourth order in 1 / f, is below 1e-9 px.
        """
        uu, vv = np.meshgrid(u_px, v_px)
        nodes = self.back_project(uu.ravel(), vv.ravel())
        x, y, area = (
            RectBivariateSpline(v_px, u_px, values.reshape(uu.shape))(samples_v, samples_u)
            for values in (nodes.x, nodes.y, nodes.area)
        )
        return LinesOfSight(x, y, area)

    def _miss(self, xy: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Target minus projection, u and v, and the projection's Jacobian d(u, v)/d(x, y), (2, 2, n)."""
        points = np.column_stack([xy, np.ones(len(xy))]).reshape(-1, 1, 3)
        pixels, derivatives = cv2.projectPoints(points, ZERO, ZERO, self._matrix, self._distortion)
        miss = target - pixels.reshape(-1, 2)
        # OpenCV's columns: rotation (3), translation (3), ...; at depth 1 a translation is a step of (x, y).
        jacobian = np.asarray(derivatives, dtype=np.float64).reshape(len(xy), 2, -1)[:, :, 3:5]
        return miss[:, 0], miss[:, 1], jacobian.transpose(1, 2, 0)
