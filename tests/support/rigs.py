"""Rigs and made-up measurements for the unit tests, by numpy alone: independent of `workbench.optics`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import cv2
import numpy as np

from workbench.calibration.data.observations import Observation
from workbench.model.arrays import FloatArray
from workbench.model.calibration import Provenance
from workbench.model.lens import LensName
from workbench.model.prior import Prior
from workbench.model.rig import BenchSpec, CameraSpec, LaserSpec, NoiseSpec, Rig

STANDOFFS_MM = (125.0, 160.0, 210.0, 280.0, 400.0, 600.0, 900.0, 1400.0, 2200.0, 3200.0, 4500.0)


PROVENANCE = Provenance(
    session="20261122-120000-calibrate-flat",
    captures_sha256="00" * 32,
    rig="thesis",
    serial="1e5",
    command="workbench fit captures.csv --rig 'my rig.yaml'",
    version="0.1.0",
    operator="A. Technician",
    created="2026-11-22T12:00:00+0000",
)


def prior(value: float, sd: float) -> Prior:
    return Prior(value=value, sd=sd)


def thesis_rig(noise_px: float = 0.03, speckle_px: float = 0.04) -> Rig:
    """Four horizontal lasers, with the tolerances of the design."""
    lasers = tuple(
        LaserSpec(
            id=name,
            axis="u",
            x_mm=prior(x, 0.2),
            y_mm=prior(0.0, 0.2),
            tx=prior(0.0, 0.005),
            ty=prior(0.0, 0.005),
        )
        for name, x in (("L1", -60.0), ("L2", -30.0), ("L3", 30.0), ("L4", 60.0))
    )
    return Rig(
        format=1,
        rig="thesis",
        camera=CameraSpec(
            width_px=640,
            height_px=480,
            f_px=prior(533.3, 26.7),
            cx_px=prior(319.5, 40.0),
            cy_px=prior(239.5, 40.0),
            k1=prior(0.0, 0.3),
            k2=prior(0.0, 0.3),
            p1=prior(0.0, 0.0),
            p2=prior(0.0, 0.0),
        ),
        lasers=lasers,
        bench=BenchSpec(
            offset_mm=prior(0.0, 5.0),
            ruler_scale=prior(0.0, 0.0005),
            placement_sd_mm=0.3,
            tilt_sd_deg=0.5,
        ),
        noise=NoiseSpec(spot_sd_px=noise_px, speckle_sd_px=speckle_px),
    )


def grating_rig(beams: Iterable[Mapping[str, Prior]]) -> Rig:
    """A rig of beams G0, G1, ... of one emitter 60 mm beside the camera, each with its own entries."""
    rig = thesis_rig()
    common = {"emitter": "g", "x_mm": prior(60.0, 0.2)}
    lasers = tuple(
        rig.lasers[0].model_copy(update={"id": f"G{n}", **common, **own}) for n, own in enumerate(beams)
    )
    return rig.model_copy(update={"lasers": lasers})


FISHEYE_STANDOFFS_MM = (40.0, 50.0, 65.0, 85.0, 115.0, 160.0, 230.0, 350.0, 600.0, 1000.0, 1800.0)
"""The nearest spots of `fisheye_rig` lie 56 degrees off its axis."""


def fisheye_rig() -> Rig:
    """The lasers of the design before a fisheye of 120 degrees from the left edge to the right."""
    rig = thesis_rig()
    camera = CameraSpec(
        width_px=640,
        height_px=480,
        lens="equidistant",
        f_px=prior(305.6, 15.0),
        cx_px=prior(319.5, 10.0),
        cy_px=prior(239.5, 10.0),
        k1=prior(0.0, 0.05),
        k2=prior(0.0, 0.02),
        k3=prior(0.0, 0.01),
        k4=prior(0.0, 0.005),
    )
    bench = rig.bench.model_copy(update={"reach_mm": (40.0, 2000.0)})
    return rig.model_copy(update={"rig": "fisheye", "camera": camera, "bench": bench})


def draw(rng: np.random.Generator, spread: Prior) -> float:
    return float(rng.normal(spread.value, spread.sd)) if spread.sd else spread.value


def opencv_pixels(lens: LensName, values: Sequence[float], points_mm: FloatArray) -> FloatArray:
    """(n, 2) pixels of points (n, 3), by OpenCV; of a lens with f, cx, cy and coefficients `values`."""
    f, cx, cy = values[:3]
    camera = np.array([[f, 0, cx], [0, f, cy], [0, 0, 1.0]])
    points = np.ascontiguousarray(points_mm, np.float64).reshape(-1, 1, 3)
    still, coefficients = np.zeros(3), np.array(values[3:], float)
    if lens == "equidistant":
        pixels, _ = cv2.fisheye.projectPoints(points, still, still, camera, coefficients)
    else:
        pixels, _ = cv2.projectPoints(points, still, still, camera, coefficients)
    return np.asarray(pixels, np.float64).reshape(-1, 2)


@dataclass
class World:
    """A true sensor drawn from a rig's tolerances, and what it sees of a flat."""

    rig: Rig
    seed: int
    values: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        rng = np.random.default_rng(self.seed)
        for name, spread in self.rig.camera.lens_priors.items():
            self.values[name] = draw(rng, spread)
        self.values["offset_mm"] = draw(rng, self.rig.bench.offset_mm)
        self.values["ruler_scale"] = draw(rng, self.rig.bench.ruler_scale)
        of_bench = np.random.default_rng([self.seed, 3])
        for name in ("target_slope_x", "target_slope_y", "drift_u_px", "drift_v_px"):
            self.values[name] = draw(of_bench, getattr(self.rig.bench, name))
        for laser in self.rig.lasers:
            for name in ("x_mm", "y_mm", "tx", "ty"):
                self.values[f"{laser.id}.{name}"] = draw(rng, getattr(laser, name))

    def pixel(self, laser_id: str, z0_mm: float, yaw: float = 0.0, pitch: float = 0.0) -> FloatArray:
        """(2,) where the laser's spot on a tilted flat appears, by linear algebra and OpenCV's lens."""
        x, y, tx, ty = (self.values[f"{laser_id}.{name}"] for name in ("x_mm", "y_mm", "tx", "ty"))
        system = np.array([[1, 0, -tx], [0, 1, -ty], [-np.tan(yaw), -np.tan(pitch), 1.0]])
        point = np.linalg.solve(system, [x, y, z0_mm])
        return np.asarray(self.pixels(point[None])[0])

    @property
    def common_tilt(self) -> FloatArray:
        """(2,) yaw and pitch of the target at every placement, radians."""
        return np.arctan([self.values["target_slope_x"], self.values["target_slope_y"]])

    def pixels(self, points_mm: FloatArray) -> FloatArray:
        """(n, 2) where points (n, 3) in the camera frame appear, by OpenCV's lens."""
        camera = self.rig.camera
        return opencv_pixels(camera.lens, [self.values[name] for name in camera.lens_priors], points_mm)

    def observations(
        self, standoffs_mm: tuple[float, ...] = STANDOFFS_MM, repeats: int = 5, session: int = 1
    ) -> list[Observation]:
        """A whole calibration: placement errors, tilts, speckle and noise drawn from the rig's tolerances.

        The image drifts linearly from the first observation to the last.
        """
        rng = np.random.default_rng([self.seed, session])
        bench, noise = self.rig.bench, self.rig.noise
        found = []
        for standoff in standoffs_mm:
            error = rng.normal(0.0, bench.placement_sd_mm)
            yaw, pitch = np.radians(rng.normal(0.0, bench.tilt_sd_deg, 2)) + self.common_tilt
            z0 = standoff * (1 + self.values["ruler_scale"]) + error + self.values["offset_mm"]
            for laser in self.rig.lasers:
                centre = self.pixel(laser.id, z0, yaw, pitch) + rng.normal(0, noise.speckle_sd_px, 2)
                for repeat in range(repeats):
                    u, v = centre + rng.normal(0.0, noise.spot_sd_px, 2)
                    if 0 <= u <= self.rig.camera.width_px - 1 and 0 <= v <= self.rig.camera.height_px - 1:
                        source = f"{laser.id} {standoff:g} {repeat}"
                        found.append(
                            Observation(
                                source, laser.id, f"{standoff:g}", standoff, repeat, float(u), float(v)
                            )
                        )
        drift = np.array([self.values["drift_u_px"], self.values["drift_v_px"]])
        shifts = np.linspace(-0.5, 0.5, len(found))[:, None] * drift
        return [
            replace(s, u_px=s.u_px + float(du), v_px=s.v_px + float(dv))
            for s, (du, dv) in zip(found, shifts, strict=True)
        ]


def board_rig(print_scale: Prior | None = None) -> Rig:
    """The design's tolerances, lenses that do not fold in the picture, and the print by a steel rule."""
    rig = thesis_rig()
    bench = rig.bench.model_copy(
        update={"print_scale": print_scale or prior(0.0, 0.0005), "board_flatness_sd_mm": 0.05}
    )
    camera = rig.camera.model_copy(update={"k1": prior(0.0, 0.1), "k2": prior(0.0, 0.05)})
    return rig.model_copy(update={"bench": bench, "camera": camera})
