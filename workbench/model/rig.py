"""Schema of the rig file: prior knowledge about a sensor and its bench, and the drivers of its devices."""

from __future__ import annotations

from math import radians, tan
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, ConfigDict, Field, ValidationInfo, field_validator, model_validator

from workbench.model.board import Board
from workbench.model.bounds import applies, prior_within, within
from workbench.model.device_block import DeviceBlock
from workbench.model.errors import BadInputError
from workbench.model.head_spec import HeadSpec
from workbench.model.included_camera import include_camera
from workbench.model.known_board import AnyBoard
from workbench.model.lens import COEFFICIENTS, LensName, lens_parameters
from workbench.model.name import LaserId, Name
from workbench.model.prior import LARGEST, Baseline, Coefficient, Drift, Prior, Scale, Slope, exactly
from workbench.model.yamlfile import Document, FileModel, load_yaml_model

PositiveFloat = Annotated[float, Field(gt=0)]
NonNegativeFloat = Annotated[float, Field(ge=0)]


ImageAxis = Literal["u", "v"]
"""Axis of the image: u to the right, v down."""
FEWEST_PX = 16
MOST_PX = 100_000
"""Smallest and largest accepted width or height of an image."""
MOST_PIXELS = 2**28
"""Largest accepted product of width and height: no camera has more pixels."""


SpotSd = Annotated[float, Field(ge=1e-6), within(0, 100, "pixels; a spot is some pixels wide")]

TARGET_TILT = ("target_slope_x", "target_slope_y")
"""Parameters of a calibration: tilt of the target that all placements share, as slopes."""
TiltAngle = Annotated[float, within(-60, 60, "degrees")]
TiltSd = Annotated[float, within(0, 45, "degrees")]


def _slope(angle_deg: float, sd_deg: float) -> Prior:
    """Prior of the tangent of an angle: d tan(a) = (1 + tan^2 a) da."""
    slope = tan(radians(angle_deg))
    return Prior(value=slope, sd=radians(sd_deg) * (1.0 + slope**2))


DECENTRED = Prior(value=0.0, sd=0.002)
"""Tangential distortion of a lens about which nothing is stated: no lens is centred exactly."""


class CameraSpec(FileModel):
    """Camera: image format, and the lens according to its data sheet."""

    width_px: Annotated[int, within(FEWEST_PX, MOST_PX, "pixels of the image")]
    height_px: Annotated[int, within(FEWEST_PX, MOST_PX, "pixels of the image")]
    bits: Annotated[int, Field(ge=8, le=16)] = 8
    lens: LensName = "plumb_bob"
    """Lens model; it selects the distortion coefficients below. Other coefficients are not used."""
    f_px: Annotated[Prior, prior_within(1, LARGEST, LARGEST, "pixels: millimetres over the pixel pitch")]
    cx_px: Prior
    cy_px: Prior
    k1: Coefficient = exactly(0.0)
    k2: Coefficient = exactly(0.0)
    p1: Coefficient = DECENTRED
    p2: Coefficient = DECENTRED
    k3: Coefficient = exactly(0.0)
    k4: Coefficient = exactly(0.0)

    @field_validator("height_px")
    @classmethod
    def _is_an_image(cls, height_px: int, info: ValidationInfo) -> int:
        if applies(info) and (pixels := height_px * info.data.get("width_px", 0)) > MOST_PIXELS:
            raise ValueError(f"expected at most {MOST_PIXELS} pixels (width x height), got {pixels}")
        return height_px

    @field_validator("cx_px", "cy_px")
    @classmethod
    def _is_near_the_image(cls, centre: Prior, info: ValidationInfo) -> Prior:
        side = info.data.get("width_px" if info.field_name == "cx_px" else "height_px")
        if side is None or not applies(info):
            return centre
        if not (abs(centre.value - side / 2) <= 2 * side and centre.sd <= 2 * side):
            raise ValueError(
                f"expected the principal point within {2 * side} px of the image's centre, and an sd below"
                f" this, got {centre.value:g} +- {centre.sd:g}"
            )
        return centre

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
        if f_px.sd > f_px.value:
            raise ValueError(f"expected an sd below the value, {f_px.value:g}, got {f_px.sd:g}")
        return f_px

    @property
    def lens_priors(self) -> dict[str, Prior]:
        """Priors of the lens model's parameters by name, in the order of the model."""
        return {name: getattr(self, name) for name in lens_parameters(self.lens)}


class LaserSpec(FileModel):
    """One laser as a ray in the camera frame: origin (x, y, 0) mm, direction (tx, ty, 1)."""

    id: LaserId
    axis: ImageAxis | None = None
    """Image axis along which the spot moves with range, if it is one: u for a laser beside the camera, v for
    one above or below. The position decides it: the key is a check of the position, and may be left out."""
    emitter: LaserId | None = None
    """Name of the laser that emits this beam and others, by a grating: all its beams are on together. They
    are in a row, so that their order assigns their spots. None: a laser of its own."""
    x_mm: Baseline
    y_mm: Baseline
    tx: Slope = exactly(0.0)
    ty: Slope = exactly(0.0)

    @model_validator(mode="after")
    def _has_a_baseline(self) -> LaserSpec:
        if self.id in {"all", "board"}:
            raise ValueError(
                f"a laser must not have the id {self.id!r}, which is reserved in captures.csv; rename it"
            )
        if self.x_mm.value == self.y_mm.value == 0:
            raise ValueError("a laser needs a baseline: x_mm and y_mm must not both be 0")
        along, name = (self.y_mm, "y_mm") if self.axis == "v" else (self.x_mm, "x_mm")
        if self.axis is not None and along.value == 0:
            raise ValueError(f"a laser on axis {self.axis} needs a baseline: {name} must not be 0")
        return self


def nearest_image_axis(laser: LaserSpec) -> ImageAxis:
    """Image axis nearest to the direction in which a laser's spot moves."""
    return "u" if abs(laser.x_mm.value) >= abs(laser.y_mm.value) else "v"


class BenchSpec(FileModel):
    """Ruler and target: uncertainty of standoffs. All standard deviations are 1 sigma."""

    offset_mm: Baseline = exactly(0.0)
    """Distance of the pinhole behind the rig's reference plane: z = standoff + offset."""
    ruler_scale: Scale = exactly(0.0)
    """Relative error of the ruler: true standoff = ruler reading x (1 + ruler_scale)."""
    placement_sd_mm: Annotated[float, within(0, 1000, "millimetres")] = 0.0
    tilt_sd_deg: TiltSd = 0.0
    """Tilt of a flat target about each of its two axes, independent at every placement."""
    target_yaw_deg: TiltAngle = 0.0
    """Tilt about the vertical common to all placements, as measured: the rail or the target's mount is not
    square to the optical axis. Positive: the target's right side is farther away."""
    target_pitch_deg: TiltAngle = 0.0
    """Common tilt about the horizontal. Positive: the target's lower side is farther away."""
    target_tilt_sd_deg: TiltSd = 0.5
    """Standard uncertainty of the common tilt about each of the two axes."""
    drift_u_px: Drift = exactly(0.0)
    """Shift of the image from the first capture to the last, linear in the running time of the session. With
    sd 0 it is fixed at its value; the fit frees it if the data show a drift."""
    drift_v_px: Drift = exactly(0.0)
    reach_mm: tuple[PositiveFloat, PositiveFloat] = (100.0, 5000.0)
    """Nearest and farthest standoff at which the target can be placed without saturated spots."""
    print_scale: Scale = Prior(value=0.0, sd=0.002)
    """Relative error of the printed board: true length = nominal length x (1 + print_scale)."""
    board_flatness_sd_mm: Annotated[float, within(0, 100, "millimetres")] = 0.1
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

    spot_sd_px: SpotSd = 0.1
    """Noise of one spot if its row states none."""
    speckle_sd_px: Annotated[float, within(0, 100, "pixels")] = 0.0
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


UNKNOWN_SERIAL = "unknown"
"""Serial number of a rig whose file states none."""


class Rig(FileModel):
    """A rig file, format 1."""

    kind_key = "rig"

    @classmethod
    def include_files(cls, document: Document) -> bool:
        """Replace `camera.from`, a camera file of another program, by the priors that it gives."""
        return include_camera(document)

    format: Literal[1]
    rig: str
    serial: Name = UNKNOWN_SERIAL
    driver: str | None = None
    """Driver of the bench: `opencv+serial` or None for separate `devices`; else an entry point in the group
    `workbench.benches`. A rig without driver and devices can be fitted but not run."""
    laser_class: LaserClass | None = None
    """Class of the most dangerous laser; the safety prompt asks for protection against it."""
    devices: DeviceSpec | None = None
    """Ignored if the driver opens a whole bench."""
    camera: CameraSpec
    lasers: tuple[LaserSpec, ...] = ()
    """Empty: a camera alone, to be fitted to views of a board."""
    head: HeadSpec | None = None
    """Scanning head that turns one of the lasers; None: all lasers are fixed."""
    bench: BenchSpec = BenchSpec()
    board: AnyBoard = Board()
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

    @model_validator(mode="after")
    def _head_turns_a_laser(self) -> Rig:
        if self.head is None:
            return self
        if (wanted := self.head.laser) not in self.laser_ids:
            raise ValueError(
                f"head.laser: expected a laser of the rig ({', '.join(self.laser_ids)}), got {wanted}"
            )
        if nearest_image_axis(self.head_laser) != "u":
            raise ValueError(
                f"head.laser: expected a laser beside the camera, got {wanted}, which is above or below it"
            )
        return self

    @property
    def scanning_head(self) -> HeadSpec:
        """The scanning head.

        Raises:
            BadInputError: the rig has none.
        """
        if self.head is None:
            raise BadInputError(
                f"rig {self.rig}: expected a scanning head, with the key head (docs/scanning.md), got none"
            )
        return self.head

    @property
    def head_laser(self) -> LaserSpec:
        """Laser that the head turns; raises the error of `scanning_head`."""
        return self.lasers[self.laser_ids.index(self.scanning_head.laser)]

    @field_validator("lasers")
    @classmethod
    def _beams_differ(cls, lasers: tuple[LaserSpec, ...]) -> tuple[LaserSpec, ...]:
        seen: dict[tuple[float, ...], str] = {}
        for laser in lasers:
            beam = tuple(prior.value for prior in (laser.x_mm, laser.y_mm, laser.tx, laser.ty))
            if (other := seen.setdefault(beam, laser.id)) != laser.id:
                raise ValueError(
                    f"lasers at different places or with different directions are expected, got {other} and"
                    f" {laser.id} with the same beam; correct x_mm, y_mm, tx or ty of one of them"
                )
        return lasers

    @property
    def banded_board(self) -> Board:
        """The workbench's own board, whose blank band takes the spots.

        Raises:
            BadInputError: the rig has another board.
        """
        if not isinstance(self.board, Board):
            raise BadInputError(
                f"rig {self.rig}: expected the workbench's own board (`workbench target` prints it), whose"
                f" blank band takes the spots, got board.kind {self.board.kind}; views of a"
                f" {self.board.kind} are for `workbench fit`"
            )
        return self.board

    @property
    def emitters(self) -> tuple[tuple[LaserSpec, ...], ...]:
        """Lasers that are on together, one group for each output of the controller, in the file's order."""
        groups: dict[tuple[bool, str], list[LaserSpec]] = {}
        for laser in self.lasers:
            key = (True, laser.id) if laser.emitter is None else (False, laser.emitter)
            groups.setdefault(key, []).append(laser)
        return tuple(tuple(group) for group in groups.values())

    @property
    def laser_lines(self) -> tuple[int, ...]:
        """Index of each laser's output of the controller."""
        line_of = {laser.id: n for n, group in enumerate(self.emitters) for laser in group}
        return tuple(line_of[laser.id] for laser in self.lasers)

    @property
    def laser_ids(self) -> tuple[str, ...]:
        """Ids in the order of the file."""
        return tuple(laser.id for laser in self.lasers)


def load_rig(path: Path, *, camera_alone: bool = False) -> Rig:
    """Read a rig file.

    Args:
        path: rig file.
        camera_alone: whether a rig without lasers is accepted.

    Raises:
        BadInputError: see `load_yaml_model`; or the rig has no lasers.
    """
    rig = load_yaml_model(path, Rig)
    if not rig.lasers and not camera_alone:
        raise BadInputError(
            f"{path}: lasers: expected at least one laser, got none; without lasers, `workbench fit` alone"
            " uses the file, for the camera"
        )
    return rig
