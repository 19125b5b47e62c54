"""Surfaces and their intersections with rays. Camera frame, mm; the front side faces the sensor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray

NODES = 2049
"""Number of nodes for the interpolation of depths."""
FARTHEST_INVERSE = 1e-6
"""Inverse of the largest distance of an intersection, 1/mm."""


class Surface(Protocol):
    """Opaque surface in front of the sensor."""

    @property
    def albedo(self) -> float:
        """Diffuse reflectance."""

    def depth(self, origin: FloatArray, direction: FloatArray) -> FloatArray:
        """First t > 0 at which origin + t direction meets the surface; NaN if it does not.

        Shapes: origin (3,) or (n, 3), direction (n, 3) with third component 1, result (n,).
        """

    def normal(self, points: FloatArray) -> FloatArray:
        """Unit normals (n, 3) towards the front at points (n, 3) on the surface."""

    def shade(self, points: FloatArray) -> FloatArray | float:
        """Diffuse reflectance at points (n, 3) on the surface, relative to `albedo`."""

    def unhidden(self, source: FloatArray, points: FloatArray) -> BoolArray | bool:
        """Whether no other body lies between points (n, 3) and the camera, or a source of light (3,)."""


class Alone:
    """Surface that nothing hides."""

    def unhidden(self, source: FloatArray, points: FloatArray) -> bool:
        """See `Surface`."""
        return True


class Plain(Alone):
    """Surface of uniform reflectance that nothing hides."""

    def shade(self, points: FloatArray) -> float:
        """See `Surface`."""
        return 1.0


@dataclass(frozen=True)
class PlaneSurface(Plain):
    """Plane z = z0 + slope_x x + slope_y y, bounded by half sizes around (centre_x, 0)."""

    z0_mm: float
    slope_x: float
    slope_y: float
    albedo: float
    half_width_mm: float = np.inf
    half_height_mm: float = np.inf
    centre_x_mm: float = 0.0

    def depth(self, origin: FloatArray, direction: FloatArray) -> FloatArray:
        """See `Surface`."""
        gradient = np.array([-self.slope_x, -self.slope_y, 1.0])
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (self.z0_mm - origin @ gradient) / (direction @ gradient)
        with np.errstate(invalid="ignore"):
            x = (origin[..., 0] + t * direction[:, 0] - self.centre_x_mm) * np.hypot(1, self.slope_x)
            y = (origin[..., 1] + t * direction[:, 1]) * np.hypot(1, self.slope_y)
            met = (t > 0) & (np.abs(x) <= self.half_width_mm) & (np.abs(y) <= self.half_height_mm)
        return np.where(met, t, np.nan)

    def normal(self, points: FloatArray) -> FloatArray:
        """See `Surface`."""
        normal = np.array([self.slope_x, self.slope_y, -1.0])
        return np.broadcast_to(normal / np.linalg.norm(normal), points.shape)


@dataclass(frozen=True)
class SeenInMirror(Plain):
    """Mirror image of a surface: behind the mirror, on the continuation of the beam."""

    image: PlaneSurface
    mirror: PlaneSurface

    @property
    def albedo(self) -> float:
        """See `Surface`."""
        return self.image.albedo

    def depth(self, origin: FloatArray, direction: FloatArray) -> FloatArray:
        """See `Surface`; rays that miss the mirror do not meet the image."""
        through = np.isfinite(self.mirror.depth(origin, direction))
        return np.where(through, self.image.depth(origin, direction), np.nan)

    def normal(self, points: FloatArray) -> FloatArray:
        """See `Surface`."""
        return self.image.normal(points)


def wall_in_mirror(mirror: PlaneSurface, wall_z_mm: float, albedo: float) -> SeenInMirror | None:
    """Mirror image of the wall z = `wall_z_mm` behind the sensor; None if the mirror does not show it.

    A mirror turned by 45 degrees or more deflects the beam to the side, not to the wall.
    """
    normal = np.array([-mirror.slope_x, -mirror.slope_y, 1.0]) / np.hypot(
        np.hypot(mirror.slope_x, mirror.slope_y), 1
    )
    distance = (wall_z_mm - mirror.z0_mm) * normal[2]
    point = np.array([0.0, 0.0, wall_z_mm]) - 2 * distance * normal
    turned = np.array([0.0, 0.0, 1.0]) - 2 * normal[2] * normal
    if turned[2] >= -1e-3:
        return None
    slope_x, slope_y = float(-turned[0] / turned[2]), float(-turned[1] / turned[2])
    z0 = float(point[2] - slope_x * point[0] - slope_y * point[1])
    return SeenInMirror(PlaneSurface(z0, slope_x, slope_y, albedo), mirror)


@dataclass(frozen=True)
class CylinderSurface(Plain):
    """Vertical cylinder with its axis through (axis_x, axis_z)."""

    axis_x_mm: float
    axis_z_mm: float
    radius_mm: float
    albedo: float

    def depth(self, origin: FloatArray, direction: FloatArray) -> FloatArray:
        """See `Surface`."""
        ox, oz = origin[..., 0] - self.axis_x_mm, origin[..., 2] - self.axis_z_mm
        dx, dz = direction[:, 0], direction[:, 2]
        a, half_b, c = dx**2 + dz**2, ox * dx + oz * dz, ox**2 + oz**2 - self.radius_mm**2
        root = half_b**2 - a * c
        t = (-half_b - np.sqrt(np.where(root >= 0, root, np.nan))) / a
        return np.where(t > 0, t, np.nan)

    def normal(self, points: FloatArray) -> FloatArray:
        """See `Surface`."""
        out = points - np.array([self.axis_x_mm, 0.0, self.axis_z_mm])
        out[:, 1] = 0.0
        return np.asarray(out / np.linalg.norm(out, axis=1, keepdims=True))


@dataclass(frozen=True)
class PolynomialSurface(Plain):
    """Vertical surface z = z0 + sum of c[k] (x - shift)^(k + 1)."""

    z0_mm: float
    coefficients: tuple[float, ...]
    shift_mm: float
    albedo: float

    def depth(self, origin: FloatArray, direction: FloatArray) -> FloatArray:
        """See `Surface`.

        For rays with a common origin the depth depends only on their first component. Many rays are therefore
        interpolated between `NODES` exact solutions, a few hundredths of a pixel apart.
        """
        if origin.ndim > 1 or len(direction) <= NODES:
            return self._first_crossing(origin, direction)
        x = np.linspace(direction[:, 0].min(), direction[:, 0].max(), NODES)
        nodes = np.column_stack([x, np.zeros(NODES), np.ones(NODES)])
        return np.interp(direction[:, 0], x, self._first_crossing(origin, nodes))

    def normal(self, points: FloatArray) -> FloatArray:
        """See `Surface`."""
        slope = np.polynomial.Polynomial([0.0, *self.coefficients]).deriv()(points[:, 0] - self.shift_mm)
        out = np.stack([slope, np.zeros_like(slope), -np.ones_like(slope)], axis=1)
        return np.asarray(out / np.linalg.norm(out, axis=1, keepdims=True))

    def _first_crossing(self, origin: FloatArray, direction: FloatArray) -> FloatArray:
        """Exact `depth` of each ray.

        All crossings are eigenvalues of a companion matrix, so that none is missed. The unknown is 1/t. Its
        leading coefficient is the gap at the ray's origin, which does not vanish. A degree that is lost along
        a ray of constant x appears as 1/t = 0 instead of a division by zero.
        """
        p = self._along(origin, direction)
        degree = p.shape[1] - 1
        companion = np.zeros((len(p), degree, degree))
        companion[:, 1:, :-1] = np.eye(degree - 1)
        companion[:, :, -1] = -p[:, :0:-1] / p[:, :1]
        inverse = np.linalg.eigvals(companion)
        real = np.abs(inverse.imag) <= 1e-7 * np.abs(inverse)
        first = np.where(real, inverse.real, -np.inf).max(axis=1)
        return np.where(first > FARTHEST_INVERSE, 1 / np.maximum(first, FARTHEST_INVERSE), np.nan)

    def _along(self, origin: FloatArray, direction: FloatArray) -> FloatArray:
        """Coefficients (n, degree + 1) of surface - ray in powers of t."""
        x0 = np.broadcast_to(origin[..., 0] - self.shift_mm, len(direction))
        total = np.zeros((len(direction), len(self.coefficients) + 1))
        total[:, 0] = self.z0_mm - origin[..., 2]
        total[:, 1] = -direction[:, 2]
        power = np.zeros_like(total)
        power[:, 0] = 1.0
        for c in self.coefficients:
            shifted = np.concatenate([np.zeros((len(power), 1)), power[:, :-1]], axis=1)
            power = x0[:, None] * power + direction[:, :1] * shifted
            total += c * power
        return total
