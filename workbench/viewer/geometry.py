"""Geometry of the sensor for drawing: parameters of the rig file, or of the fit once there is one.

Camera frame, millimetres: x right, y down, z forward, origin in the pinhole.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import radians, tan

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.model.calibration import Calibration
from workbench.model.event import ParameterRecord
from workbench.model.lens import LensName
from workbench.model.rig import Rig
from workbench.model.target import BoardTarget, FlatTarget
from workbench.optics.lens_models import lens_model
from workbench.optics.rays import RAY
from workbench.optics.undistort import undistort


@dataclass(frozen=True)
class Geometry:
    """Lens, laser rays and the pinhole's distance behind the reference plane."""

    lens_name: LensName
    lens: Mapping[str, float]
    """Parameters of the lens model by name, in the order of the model."""
    offset_mm: float
    rays: Mapping[str, tuple[float, float, float, float]]
    """(x_mm, y_mm, tx, ty) of each laser."""

    @classmethod
    def of_rig(cls, rig: Rig) -> Geometry:
        """Geometry from the priors of the rig file."""
        return cls(
            lens_name=rig.camera.lens,
            lens={name: prior.value for name, prior in rig.camera.lens_priors.items()},
            offset_mm=rig.bench.offset_mm.value,
            rays={
                laser.id: (laser.x_mm.value, laser.y_mm.value, laser.tx.value, laser.ty.value)
                for laser in rig.lasers
            },
        )

    def fitted(self, parameters: Iterable[ParameterRecord]) -> Geometry:
        """Geometry with fitted values of the parameters (`f_px`, `offset_mm`, `<laser id>.x_mm`, ...)."""
        return self._with({parameter.name: parameter.value for parameter in parameters})

    def calibrated(self, calibration: Calibration) -> Geometry:
        """Geometry of a calibration file."""
        return self._with(calibration.geometry())

    def _with(self, fit: Mapping[str, float]) -> Geometry:
        rays = {}
        for laser, (x, y, tx, ty) in self.rays.items():
            old = dict(zip(RAY, (x, y, tx, ty), strict=True))
            rays[laser] = tuple(fit.get(f"{laser}.{name}", old[name]) for name in RAY)
        return Geometry(
            lens_name=self.lens_name,
            lens={name: fit.get(name, value) for name, value in self.lens.items()},
            offset_mm=fit.get("offset_mm", self.offset_mm),
            rays={laser: (ray[0], ray[1], ray[2], ray[3]) for laser, ray in rays.items()},
        )

    @property
    def camera_matrix(self) -> FloatArray:
        """Camera matrix (3, 3), pixels; the centre of the top-left pixel is (0, 0)."""
        f, cx, cy = (self.lens[name] for name in ("f_px", "cx_px", "cy_px"))
        return np.array([[f, 0.0, cx], [0.0, f, cy], [0.0, 0.0, 1.0]])

    def ray_at(self, laser: str, z_mm: float) -> tuple[float, float, float]:
        """Point of a laser's ray at depth `z_mm`, mm."""
        x, y, tx, ty = self.rays[laser]
        return (x + tx * z_mm, y + ty * z_mm, z_mm)

    def spot_on(self, laser: str, target: FlatTarget | BoardTarget, standoff_mm: float) -> FloatArray:
        """Spot (2,), px, of a laser on a flat target."""
        x, y, tx, ty = self.rays[laser]
        slope_x, slope_y = tan(radians(target.yaw_deg)), tan(radians(target.pitch_deg))
        facing = 1.0 - slope_x * tx - slope_y * ty
        depth = (standoff_mm + self.offset_mm + slope_x * x + slope_y * y) / facing
        return self._project(self.ray_at(laser, depth))

    def scanline(self, laser: str, reach_mm: tuple[float, float]) -> FloatArray:
        """(2, 2) spots of a laser at both ends of the reach, px."""
        return np.array([self._project(self.ray_at(laser, z + self.offset_mm)) for z in reach_mm])

    def _project(self, point_mm: tuple[float, float, float]) -> FloatArray:
        x, y, z = np.array(point_mm)[:, None]
        # Arrays of numpy throughout: JAX takes a hundred times longer for a single point.
        lens = np.array(list(self.lens.values()))[:, None]
        return np.concatenate(
            [np.asarray(part) for part in lens_model(self.lens_name).project(lens, x / z, y / z)]
        )

    def seen_on(self, target: FlatTarget | BoardTarget, standoff_mm: float, pixels: FloatArray) -> FloatArray:
        """Points where the lines of sight of `pixels`, (N, 2), meet a flat target: (N, 3) mm."""
        slope_x, slope_y = tan(radians(target.yaw_deg)), tan(radians(target.pitch_deg))
        sight = undistort(lens_model(self.lens_name), np.array(list(self.lens.values())), pixels)
        facing = 1.0 - slope_x * sight[:, 0] - slope_y * sight[:, 1]
        depth = (standoff_mm + self.offset_mm) / facing
        return np.column_stack([sight * depth[:, None], depth])
