"""Geometry of the sensor for drawing: parameters of the rig file, or of the fit once there is one.

Camera frame, millimetres: x right, y down, z forward, origin in the pinhole.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from math import radians, tan

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.model.calibration import Calibration
from workbench.model.event import ParameterRecord
from workbench.model.lens import LensName
from workbench.model.rig import Rig
from workbench.model.target import BoardTarget, FlatTarget, Placement
from workbench.optics.lens_models import lens_model
from workbench.optics.rays import RAY
from workbench.optics.undistort import undistort

EXPECTED_SD = 2.0
"""Half axes of the ellipse about an expected spot, in standard deviations."""
ELLIPSE_POINTS = 33
STEP_SD = 0.1
"""Step of the numerical derivatives, in standard deviations of the parameter."""


@dataclass(frozen=True)
class Uncertain:
    """Covariance of parameters by their names, in their units."""

    names: tuple[str, ...]
    covariance: FloatArray

    @property
    def sd(self) -> FloatArray:
        """Standard deviations."""
        return np.sqrt(np.diag(self.covariance))


@dataclass(frozen=True)
class Geometry:
    """Lens, laser rays and the pinhole's distance behind the reference plane."""

    lens_name: LensName
    lens: Mapping[str, float]
    """Parameters of the lens model by name, in the order of the model."""
    offset_mm: float
    rays: Mapping[str, tuple[float, float, float, float]]
    """(x_mm, y_mm, tx, ty) of each laser."""
    uncertain: Uncertain | None = None
    """None: only standard deviations are known, which overstate that of a spot."""

    @classmethod
    def of_rig(cls, rig: Rig) -> Geometry:
        """Geometry from the priors of the rig file."""
        priors = {**rig.camera.lens_priors, "offset_mm": rig.bench.offset_mm}
        priors |= {f"{laser.id}.{name}": getattr(laser, name) for laser in rig.lasers for name in RAY}
        sd = np.array([prior.sd for prior in priors.values()])
        return cls(
            uncertain=Uncertain(tuple(priors), np.diag(sd**2)),
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
        return self.with_values({parameter.name: parameter.value for parameter in parameters})

    def calibrated(self, calibration: Calibration) -> Geometry:
        """Geometry of a calibration file."""
        parameters = calibration.laser_ranger.parameters
        uncertain = Uncertain(parameters.names, parameters.covariance_array)
        return replace(self.with_values(calibration.geometry()), uncertain=uncertain)

    def with_values(self, fit: Mapping[str, float]) -> Geometry:
        """Geometry with other values of some parameters by name, of unknown covariance."""
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

    def spot_ellipse(
        self, laser: str, target: FlatTarget | BoardTarget, standoff_mm: float
    ) -> FloatArray | None:
        """(ELLIPSE_POINTS, 2) outline, px, of `EXPECTED_SD` standard deviations about an expected spot.

        It is due to the parameters, by a linear model; errors of the placement are not in it. None if their
        covariance is not known.
        """
        if self.uncertain is None:
            return None
        slopes = []
        for name, sd in zip(self.uncertain.names, self.uncertain.sd, strict=True):
            step = max(STEP_SD * sd, np.finfo(float).tiny)
            ends = [self._moved(name, way * step) for way in (1.0, -1.0)]
            upper, lower = (end.spot_on(laser, target, standoff_mm) for end in ends)
            slopes.append((upper - lower) / (2 * step) if sd else np.zeros(2))
        jacobian = np.array(slopes).T
        values, vectors = np.linalg.eigh(jacobian @ self.uncertain.covariance @ jacobian.T)
        axes = EXPECTED_SD * vectors * np.sqrt(np.maximum(values, 0.0))
        turn = np.linspace(0.0, 2.0 * np.pi, ELLIPSE_POINTS)
        circle = np.column_stack([np.cos(turn), np.sin(turn)])
        return np.asarray(self.spot_on(laser, target, standoff_mm) + circle @ axes.T)

    def _moved(self, name: str, by: float) -> Geometry:
        """Geometry with one parameter changed; unchanged for a parameter that is not of the geometry."""
        laser, _, part = name.rpartition(".")
        if laser in self.rays:
            return self.with_values({name: self.rays[laser][RAY.index(part)] + by})
        known = {**self.lens, "offset_mm": self.offset_mm}
        return self.with_values({name: known[name] + by}) if name in known else self

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


def expected_spots(
    geometry: Geometry, placement: Placement | None, lasers: Collection[str] | None = None
) -> dict[str, FloatArray]:
    """Expected spot (2,), px, of each of `lasers` (None: of all) on a flat target; empty without one."""
    if placement is None or not isinstance(placement.target, FlatTarget | BoardTarget):
        return {}
    target, standoff_mm = placement.target, placement.standoff_mm
    chosen = geometry.rays if lasers is None else lasers
    return {laser: geometry.spot_on(laser, target, standoff_mm) for laser in chosen}


def expected_ellipses(geometry: Geometry, placement: Placement | None) -> dict[str, FloatArray]:
    """Outline (N, 2), px, of the uncertainty of each expected spot; empty where it is not known."""
    if placement is None or not isinstance(placement.target, FlatTarget | BoardTarget):
        return {}
    target, standoff_mm = placement.target, placement.standoff_mm
    outlines = {laser: geometry.spot_ellipse(laser, target, standoff_mm) for laser in geometry.rays}
    return {laser: outline for laser, outline in outlines.items() if outline is not None}
