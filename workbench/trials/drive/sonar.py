"""Simulated ultrasonic ranger, as its schema states it."""

from __future__ import annotations

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.model.world import Pose, Vehicle
from workbench.trials.drive.schema import Sonar
from workbench.trials.drive.surroundings import Surroundings, vehicle_frame, world_rays

RAY_STEP_DEG = 1.5
"""Angle between neighbouring rays of the cone."""


class SonarView:
    """First echoes of a sonar in the middle of a vehicle's front, at the height of the sensor."""

    def __init__(self, sonar: Sonar, around: Surroundings, vehicle: Vehicle) -> None:
        self._sonar, self._around, self._vehicle = sonar, around, vehicle
        half = sonar.full_angle_deg / 2
        side = np.arange(-half, half + 1e-9, RAY_STEP_DEG)
        azimuth, elevation = (grid.ravel() for grid in np.meshgrid(side, side))
        inside = np.hypot(azimuth, elevation) <= half + 1e-9
        a, e = np.radians(azimuth[inside]), np.radians(elevation[inside])
        self._rays = np.column_stack([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])
        self._points = [_dense(points) for points in around.points()]

    def echo_mm(self, pose: Pose) -> float | None:
        """Distance of the first echo without noise; None without one.

        Rays fill the cone. Further rays are aimed at each body, so that none passes between them: at points
        along the axis of a round one, and at edges.
        """
        rays = np.vstack([self._rays, self._aimed(pose)])
        origins = np.zeros_like(rays)
        origins, directions = world_rays(pose, self._vehicle, origins, rays)
        hits = self._around.first_hits(origins, directions)
        incidence_cos = np.abs((hits.normal * directions).sum(axis=1))
        returned = incidence_cos >= np.cos(np.radians(self._sonar.specular_deg))
        distance = hits.distance_mm[returned & (hits.distance_mm <= self._sonar.farthest_mm)]
        return float(max(distance.min(), self._sonar.nearest_mm)) if len(distance) else None

    def _aimed(self, pose: Pose) -> FloatArray:
        """(n, 3) unit rays in the camera frame towards points of bodies within the cone."""
        points = vehicle_frame(pose, np.concatenate(self._points))
        ahead, left, up = points.T
        rays = np.column_stack([-left, self._vehicle.sensor_height_mm - up, ahead])
        rays = rays[(ahead > 0) & (ahead < self._sonar.farthest_mm)]
        rays /= np.linalg.norm(rays, axis=1)[:, None]
        return np.asarray(rays[rays[:, 2] >= np.cos(np.radians(self._sonar.full_angle_deg / 2))])


def _dense(points: FloatArray) -> FloatArray:
    """Points of a body, without those of planes, which the cone meets in any case."""
    return np.asarray(points[np.abs(points).max(axis=1) < 1e5])
