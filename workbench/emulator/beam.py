"""Gaussian laser beam in free space."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from workbench.emulator.spec import BeamSpec
from workbench.emulator.truth import TrueRay
from workbench.model.arrays import FloatArray

RINGS = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0)
"""Circles around the axis that sample a beam's section, in its 1/e^2 radii."""
RAYS_OF_RING = 24


class Beam:
    """Beam of one laser, camera frame, mm."""

    def __init__(self, ray: TrueRay, spec: BeamSpec) -> None:
        self.origin = np.array([ray.x_mm, ray.y_mm, 0.0])
        self.direction = np.array([ray.tx, ray.ty, 1.0])
        """Direction with third component 1; not a unit vector."""
        self._axis = self.direction / np.linalg.norm(self.direction)
        self._power_w = spec.power_mw * 1e-3
        self._exit_mm = spec.exit_diameter_mm
        self._divergence = spec.divergence_mrad * 1e-3

    def irradiance(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Power per area of the surface (W / mm^2) at points (n, 3) with unit front normals (n, 3).

        The profile is a Gaussian. Its 1/e^2 diameter 2 w is exit diameter + divergence x path. The peak is
        P / (pi w^2 / 2), which makes the integral P. The cosine of incidence multiplies it. On the rear side
        and behind the origin of the beam the irradiance is 0.
        """
        to_point = points - self.origin
        path = to_point @ self._axis
        rho2 = np.einsum("ij,ij->i", to_point, to_point) - path**2
        radius = (self._exit_mm + self._divergence * path) / 2
        peak = 2 * self._power_w / (np.pi * radius**2)
        cosine = np.maximum(0.0, -normals @ self._axis)
        return np.where(path > 0, peak * np.exp(-2 * rho2 / radius**2) * cosine, 0.0)

    @cached_property
    def section(self) -> tuple[FloatArray, FloatArray]:
        """Rays (origins (n, 3), directions (n, 3)) over the beam's section; the first is its axis."""
        rings = [self.outline(radii, RAYS_OF_RING) for radii in RINGS]
        origins = np.vstack([self.origin, *(origin for origin, _ in rings)])
        return origins, np.vstack([self.direction, *(direction for _, direction in rings)])

    def outline(self, radii: float, count: int) -> tuple[FloatArray, FloatArray]:
        """Rays (origins (n, 3), directions (n, 3)) on the cone at `radii` times the beam's 1/e^2 radius.

        The radius grows linearly with the path, so the outline consists of straight lines.
        """
        angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
        across = np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=1) * radii / 2
        return self.origin + across * self._exit_mm, self.direction + across * self._divergence
