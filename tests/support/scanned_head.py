"""Spots of a scanning head by the virtual bench's own geometry, with drawn noise instead of frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import radians, tan

import numpy as np

from tests.support.virtual_truth import parameter_values
from workbench.calibration.data.observations import PlacementInfo
from workbench.calibration.scanning.fit import HeadSpots
from workbench.calibration.scanning.prediction import head_table
from workbench.emulator.head import reading_error_deg, turned
from workbench.emulator.lens import STEADY, Lens
from workbench.emulator.spec import EmulatorSpec, emulator_spec
from workbench.emulator.surfaces import CylinderSurface, PlaneSurface, Surface
from workbench.emulator.truth import TrueRay, Truth, draw_placement_error, draw_truth
from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.head_calibration import HEAD
from workbench.model.prior import Prior, exactly
from workbench.model.rig import Rig
from workbench.model.target import CylinderTarget

MARGIN_PX = 3.0


@dataclass(frozen=True)
class SimulatedHead:
    """A head with the truth that a seed draws from the rig's priors."""

    rig: Rig
    spec: EmulatorSpec
    truth: Truth

    @classmethod
    def of(cls, rig: Rig, seed: int) -> SimulatedHead:
        """Head of a seed."""
        drawn = rig.model_copy(update={"emulator": {"seed": seed}})
        spec = emulator_spec(drawn)
        return cls(drawn, spec, draw_truth(drawn, spec))

    @property
    def values(self) -> FloatArray:
        """(S,) true values of the sensor's and the head's parameters, in the order of `head_table`."""
        head = self.truth.head
        assert head is not None
        named = parameter_values(
            {name: value for name, value in asdict(self.truth).items() if name != "head"}
        )
        named |= {f"head.{name}": _of_head(head, name) for name in HEAD}
        return np.array([named[one.name] for one in head_table(self.rig, ()).parameters])

    def ray(self, key: str, reading_deg: float) -> TrueRay:
        """True ray after one move of the head."""
        head = self.truth.head
        assert head is not None
        error_deg = reading_error_deg(head, self.spec, key, reading_deg)
        return turned(self.truth.lasers[head.laser], head, reading_deg + error_deg)

    def plane(self, key: str, standoff_mm: float) -> PlaneSurface:
        """The flat at a placement, with the placement's errors."""
        error = draw_placement_error(self.rig, self.spec, key)
        return PlaneSurface(
            standoff_mm * (1 + self.truth.ruler_scale) + error.error_mm + self.truth.offset_mm,
            tan(radians(error.yaw_deg + self.truth.target_yaw_deg)),
            tan(radians(error.pitch_deg + self.truth.target_pitch_deg)),
            1.0,
        )

    def cylinder(
        self, key: str, standoff_mm: float, target: CylinderTarget, random: np.random.Generator
    ) -> CylinderSurface:
        """The cylinder at a placement, with errors along z and x, and of its diameter."""
        nearest_mm = self.plane(key, standoff_mm).z0_mm
        aside_mm = target.shift_mm + self.rig.bench.placement_sd_mm * random.standard_normal()
        diameter_mm = target.diameter_mm + (target.diameter_sd_mm or 0.0) * random.standard_normal()
        return CylinderSurface(aside_mm, nearest_mm + diameter_mm / 2, diameter_mm / 2, 1.0)

    def point(self, key: str, surface: Surface, reading_deg: float) -> FloatArray:
        """(3,) true point of the beam on a surface, camera frame; NaN if it misses."""
        ray = self.ray(key, reading_deg)
        origin, direction = np.array([ray.x_mm, ray.y_mm, 0.0]), np.array([[ray.tx, ray.ty, 1.0]])
        return np.asarray(origin + surface.depth(origin, direction)[0] * direction[0])

    def seen(
        self, points: FloatArray, sd_px: float, random: np.random.Generator
    ) -> tuple[FloatArray, BoolArray]:
        """Noisy spots (n, 2) of points (n, 3), and whether each lies in the image."""
        exact = Lens(self.truth, STEADY).project(points)
        size = np.array([self.rig.camera.width_px, self.rig.camera.height_px])
        inside = ((exact > MARGIN_PX) & (exact < size - 1 - MARGIN_PX)).all(axis=1)
        return exact + sd_px * random.standard_normal(exact.shape), np.asarray(inside)

    def spots(
        self,
        standoffs_mm: Sequence[float],
        readings_deg: Sequence[float],
        sd_px: float,
        random: np.random.Generator,
    ) -> HeadSpots:
        """Spots on the rig's flat at each standoff and reading, as far as they lie in the image."""
        keys = [f"p{number}" for number in range(len(standoffs_mm))]
        planes = [self.plane(key, mm) for key, mm in zip(keys, standoffs_mm, strict=True)]
        moves = [(number, reading) for number in range(len(keys)) for reading in readings_deg]
        points = np.array([self.point(keys[n], planes[n], reading) for n, reading in moves])
        position, inside = self.seen(points, sd_px, random)
        return HeadSpots(
            tuple(
                PlacementInfo(key, mm, float("nan"), 0.0) for key, mm in zip(keys, standoffs_mm, strict=True)
            ),
            np.array([n for n, _ in moves], np.intp)[inside],
            np.array([reading for _, reading in moves], float)[inside],
            position[inside],
            np.full_like(position[inside], sd_px),
        )


def inclined_rig(rig: Rig) -> Rig:
    """A rig of a head, well known, whose beam is inclined: turned by 30 degrees its spots are 26 px lower."""
    camera = {
        "height_px": 240,
        "f_px": Prior(value=533.0, sd=1.0),
        "cx_px": Prior(value=319.5, sd=0.5),
        "cy_px": Prior(value=19.5, sd=0.5),
        "k1": exactly(0.0),
        "k2": exactly(0.0),
    }
    lasers = (rig.head_laser.model_copy(update={"ty": Prior(value=0.3, sd=0.0005)}),)
    own = {"camera": rig.camera.model_copy(update=camera), "lasers": lasers, "emulator": {"seed": 3}}
    return rig.model_copy(update=own)


def _of_head(head: object, name: str) -> float:
    if name.endswith("_rad"):
        return radians(getattr(head, name.removesuffix("_rad") + "_deg"))
    return float(getattr(head, name))
