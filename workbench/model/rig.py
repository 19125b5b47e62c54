"""Schema of the rig file: prior knowledge about a sensor and its bench, and the drivers of its devices."""

from __future__ import annotations

from math import radians, tan
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, ConfigDict, Field, ValidationInfo, field_validator, model_validator

from workbench.model.board import Board
from workbench.model.device_block import DeviceBlock
from workbench.model.lens import COEFFICIENTS, LensName, lens_parameters
from workbench.model.yamlfile import FileModel, load_yaml_model

PositiveFloat = Annotated[float, Field(gt=0)]
NonNegativeFloat = Annotated[float, Field(ge=0)]
# YAML reads `id: 1` as a number; to the workbench an id is a name.
Name = Annotated[
    str, BeforeValidator(lambda v: str(v) if isinstance(v, int) and not isinstance(v, bool) else v)
]

ImageAxis = Literal["u", "v"]
"""Axis of the image: u to the right, v down."""
LaserId = Annotated[Name, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")]
"""Laser id; part of file names, therefore of letters, digits, `_`, `.` and `-`."""
LARGEST = 1e6
"""Largest accepted number of millimetres or pixels."""
MOST_PX = 100_000
"""Largest accepted width or height of an image."""
SMALLEST_SD = 1e-9
"""Smallest accepted standard deviation of a prior other than 0."""


class Prior(FileModel):
    """Gaussian prior of a parameter: mean and standard deviation (1 sigma).

    `sd: 0` makes the parameter a constant of the fit.
    """

    value: Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
    sd: Annotated[float, Field(ge=0, le=LARGEST)]

    @field_validator("sd")
    @classmethod
    def _is_zero_or_large_enough(cls, sd: float) -> float:
        if 0 < sd < SMALLEST_SD:
            raise ValueError(f"expected 0 (known exactly) or at least {SMALLEST_SD:g}")
        return sd


def exactly(value: float) -> Prior:
    """Prior of a constant."""
    return Prior(value=value, sd=0.0)


TARGET_TILT = ("target_slope_x", "target_slope_y")
"""Parameters of a calibration: tilt of the target that all placements share, as slopes."""
TiltAngle = Annotated[float, Field(ge=-60, le=60)]
TiltSd = Annotated[float, Field(ge=0, le=45)]


def _slope(angle_deg: float, sd_deg: float) -> Prior:
    """Prior of the tangent of an angle: d tan(a) = (1 + tan^2 a) da."""
    slope = tan(radians(angle_deg))
    return Prior(value=slope, sd=radians(sd_deg) * (1.0 + slope**2))


DECENTRED = Prior(value=0.0, sd=0.002)
"""Tangential distortion of a lens about which nothing is stated: no lens is centred exactly."""


class CameraSpec(FileModel):
    """Camera: image format, and the lens according to its data sheet."""

    width_px: Annotated[int, Field(gt=0, le=MOST_PX)]
    height_px: Annotated[int, Field(gt=0, le=MOST_PX)]
    bits: Annotated[int, Field(ge=8, le=16)] = 8
    lens: LensName = "plumb_bob"
    """Lens model; it selects the distortion coefficients below. Other coefficients are not used."""
    f_px: Prior
    cx_px: Prior
    cy_px: Prior
    k1: Prior = exactly(0.0)
    k2: Prior = exactly(0.0)
    p1: Prior = DECENTRED
    p2: Prior = DECENTRED
    k3: Prior = exactly(0.0)
    k4: Prior = exactly(0.0)

    @field_validator("k1", "k2", "p1", "p2", "k3", "k4")
    @classmethod
    def _is_of_the_lens(cls, prior: Prior, info: ValidationInfo) -> Prior:
        lens: LensName | None = info.data.get("lens")  # None: the lens itself is not valid
        if (
            lens is not None
            and info.field_name not in COEFFICIENTS[lens]
            and prior not in (exactly(0.0), DECENTRED)
        ):
            raise ValueError(
                f"expected coefficients of the lens {lens} ({', '.join(COEFFICIENTS[lens])}), got"
                f" {info.field_name}; remove it, or name another lens in camera.lens"
            )
        return prior

    @field_validator("f_px")
    @classmethod
    def _has_a_focal_length(cls, f_px: Prior) -> Prior:
        if f_px.value <= 0:
            raise ValueError(f"expected a focal length above 0, got {f_px.value:g}")
        return f_px

    @property
    def lens_priors(self) -> dict[str, Prior]:
        """Priors of the lens model's parameters by name, in the order of the model."""
        return {name: getattr(self, name) for name in lens_parameters(self.lens)}


class LaserSpec(FileModel):
    """One laser as a ray in the camera frame: origin (x, y, 0) mm, direction (tx, ty, 1)."""

    id: LaserId
    axis: ImageAxis
    """Image axis along which the spot moves with range: u for a laser beside the camera, v above or below."""
    x_mm: Prior
    y_mm: Prior
    tx: Prior = exactly(0.0)
    ty: Prior = exactly(0.0)

    @model_validator(mode="after")
    def _has_a_baseline(self) -> LaserSpec:
        if self.id in {"all", "board"}:
            raise ValueError(
                f"a laser must not have the id {self.id!r}, which is reserved in captures.csv; rename it"
            )
        along, name = (self.x_mm, "x_mm") if self.axis == "u" else (self.y_mm, "y_mm")
        if along.value == 0:
            raise ValueError(f"a laser on axis {self.axis} needs a baseline: {name} must not be 0")
        return self


class BenchSpec(FileModel):
    """Ruler and target: uncertainty of standoffs. All standard deviations are 1 sigma."""

    offset_mm: Prior = exactly(0.0)
    """Distance of the pinhole behind the rig's reference plane: z = standoff + offset."""
    ruler_scale: Prior = exactly(0.0)
    """Relative error of the ruler: true standoff = ruler reading x (1 + ruler_scale)."""
    placement_sd_mm: NonNegativeFloat = 0.0
    tilt_sd_deg: NonNegativeFloat = 0.0
    """Tilt of a flat target about each of its two axes, independent at every placement."""
    target_yaw_deg: TiltAngle = 0.0
    """Tilt about the vertical common to all placements, as measured: the rail or the target's mount is not
    square to the optical axis. Positive: the target's right side is farther away."""
    target_pitch_deg: TiltAngle = 0.0
    """Common tilt about the horizontal. Positive: the target's lower side is farther away."""
    target_tilt_sd_deg: TiltSd = 0.5
    """Standard uncertainty of the common tilt about each of the two axes."""
    drift_u_px: Prior = exactly(0.0)
    """Shift of the image from the first capture to the last, linear in the order of the captures. With sd 0
    it is fixed at its value; the fit frees it if the data show a drift."""
    drift_v_px: Prior = exactly(0.0)
    reach_mm: tuple[PositiveFloat, PositiveFloat] = (100.0, 5000.0)
    """Nearest and farthest standoff at which the target can be placed without saturated spots."""
    print_scale: Prior = Prior(value=0.0, sd=0.002)
    """Relative error of the printed board: true length = nominal length x (1 + print_scale)."""
    board_flatness_sd_mm: Annotated[float, Field(ge=0, le=LARGEST)] = 0.1
    """Deviation of the board's paper from its plane at 100 mm from its centre."""

    @property
    def target_slope_x(self) -> Prior:
        """Common tilt about the vertical as a slope."""
        return _slope(self.target_yaw_deg, self.target_tilt_sd_deg)

    @property
    def target_slope_y(self) -> Prior:
        """Common tilt about the horizontal as a slope."""
        return _slope(self.target_pitch_deg, self.target_tilt_sd_deg)

    @field_validator("reach_mm")
    @classmethod
    def _is_a_span(cls, reach_mm: tuple[float, float]) -> tuple[float, float]:
        if not reach_mm[0] < reach_mm[1] <= LARGEST:
            raise ValueError(f"expected [nearest, farthest] in mm, got {list(reach_mm)}")
        return reach_mm


class NoiseSpec(FileModel):
    """Noise of spot positions that the captures do not state, 1 sigma, pixels."""

    spot_sd_px: Annotated[float, Field(ge=1e-6)] = 0.1
    """Noise of one spot if its row states none."""
    speckle_sd_px: NonNegativeFloat = 0.0
    """Speckle noise of a centre, common to all repeats of one laser at one placement: the pattern does not
    change. Used for spots without frames; in frames it is averaged with what they show (docs/spots.md)."""


class AnyDeviceBlock(DeviceBlock):
    """Block of a device as in the file; its driver validates the settings."""

    model_config = ConfigDict(extra="allow")


class DeviceSpec(FileModel):
    """Separate devices of the bench; the driver named in a block reads it."""

    camera: AnyDeviceBlock = AnyDeviceBlock()
    lasers: AnyDeviceBlock = AnyDeviceBlock()
    target: AnyDeviceBlock = AnyDeviceBlock()


LaserClass = Annotated[
    Literal["1", "1M", "2", "2M", "3R", "3B", "4"],
    BeforeValidator(lambda v: str(v) if isinstance(v, int) and not isinstance(v, bool) else v),
]
"""Laser class according to IEC 60825-1."""


class Rig(FileModel):
    """A rig file, format 1."""

    kind_key = "rig"

    format: Literal[1]
    rig: str
    serial: Name = "unknown"
    driver: str | None = None
    """Driver of the bench: `opencv+serial` or None for separate `devices`; else an entry point in the group
    `workbench.benches`. A rig without driver and devices can be fitted but not run."""
    laser_class: LaserClass | None = None
    """Class of the most dangerous laser; the safety prompt asks for protection against it."""
    devices: DeviceSpec | None = None
    """Ignored if the driver opens a whole bench."""
    camera: CameraSpec
    lasers: Annotated[tuple[LaserSpec, ...], Field(min_length=1)]
    bench: BenchSpec = BenchSpec()
    board: Board = Board()
    noise: NoiseSpec = NoiseSpec()
    emulator: dict[str, Any] | None = None
    """Settings of the emulated bench, which validates them."""

    @field_validator("lasers")
    @classmethod
    def _laser_ids_differ(cls, lasers: tuple[LaserSpec, ...]) -> tuple[LaserSpec, ...]:
        ids = [laser.id for laser in lasers]
        if len(set(ids)) != len(ids):
            raise ValueError(f"ids must differ, got {', '.join(ids)}")
        return lasers

    @property
    def laser_ids(self) -> tuple[str, ...]:
        """Ids in the order of the file."""
        return tuple(laser.id for laser in self.lasers)


def load_rig(path: Path) -> Rig:
    """Read a rig file.

    Raises:
        BadInputError: see `load_yaml_model`.
    """
    return load_yaml_model(path, Rig)
