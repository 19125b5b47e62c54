"""Schema of the `emulator:` block of a rig file; all parameters of the virtual bench have defaults."""

from __future__ import annotations

from itertools import chain
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, ValidationInfo, field_validator

from workbench.model.bounds import within
from workbench.model.errors import BadInputError
from workbench.model.lens import COEFFICIENTS
from workbench.model.prior import LARGEST
from workbench.model.problems import problems
from workbench.model.rig import Rig, TiltAngle
from workbench.model.yamlfile import FileModel

MOST_PIXELS = 2**25
"""Largest picture of the virtual bench, which takes a second and 1 GB to render."""
Fraction = Annotated[float, Field(ge=0, le=1)]
Seconds = Annotated[float, within(1e-9, 1000, "seconds")]
PixelsPerFrame = Annotated[float, within(-100, 100, "pixels")]
Pinned = Annotated[float, within(-LARGEST, LARGEST, "millimetres or pixels")]
PinnedSlope = Annotated[float, within(-10, 10, "tangent of an angle")]
PinnedCoefficient = Annotated[float, within(-100, 100, "no lens distorts so much")]
PinnedScale = Annotated[float, within(-0.5, 0.5, "relative")]
Fault = Literal["none", "ignores_off", "hides_stuck_beam", "garbles", "silent", "stutters"]
"""Fault of the laser controller; docs/emulator.md describes each."""


class BeamSpec(FileModel):
    """Laser beams, all equal: Gaussian, 1/e^2 diameter = exit diameter + divergence x path."""

    power_mw: Annotated[float, within(1e-6, 10_000, "milliwatts")] = 1.0
    exit_diameter_mm: Annotated[float, within(0.01, 1000, "millimetres")] = 1.5
    divergence_mrad: Annotated[float, within(0, 1000, "milliradians")] = 1.6
    """Full angle of the divergence."""
    wavelength_nm: Annotated[float, within(100, 20_000, "nanometres")] = 650.0
    speckle_contrast: Fraction = 1.0
    """Contrast before pixel averaging: 1 for a target that keeps the polarisation, 0 for no speckle."""


class LensSpec(FileModel):
    """Optical properties of the lens beyond its projection."""

    f_number: Annotated[float, within(0.3, 200, "focal length over aperture")] = 2.0
    blur_px: Annotated[float, within(0, 50, "pixels")] = 0.7
    """Standard deviation of the Gaussian PSF before pixel integration."""
    transmission: Fraction = 0.6
    """Transmission of lens and band-pass filter at the laser's wavelength."""


class SensorSpec(FileModel):
    """Image sensor. The defaults are a 1/3" CCD of 45 dB: full well / read noise = 10^(45 / 20)."""

    pitch_um: Annotated[float, within(0.1, 1000, "micrometres")] = 7.5
    quantum_efficiency: Fraction = 0.3
    full_well_e: Annotated[float, within(10, 1e9, "electrons")] = 40_000.0
    """Number of electrons at full scale with gain 1."""
    read_noise_e: Annotated[float, within(0, 1e6, "electrons")] = 225.0
    black_level: Annotated[float, Field(ge=0, lt=0.5)] = 0.03
    """Pedestal as a fraction of full scale; prevents clipping of dark noise at 0."""
    blooming: Fraction = 0.0
    """Share of the charge beyond the full well that spills along the column; the rest is drained. A CCD
    without anti-blooming has 1, other sensors 0."""
    blooming_up: Fraction = 0.5
    """Share of the spilled charge that runs upwards, to smaller rows."""
    hot_pixels: Annotated[int, within(0, 1_000_000, "pixels")] = 20
    hot_pixel_e_per_s: Annotated[float, within(0, 1e12, "electrons a second")] = 3e5
    """Mean dark current of a hot pixel; the distribution is exponential."""


class AmbientSpec(FileModel):
    """Room light that passes the band-pass filter."""

    level_e_per_s: Annotated[float, within(0, 1e12, "electrons a second")] = 5e4
    """Level at the image centre; default: about 500 lx on white paper through an 11 nm filter at f/2."""
    gradient_u: Annotated[float, Field(ge=-1, le=1)] = 0.2
    """Relative change over the image's full width."""
    gradient_v: Annotated[float, Field(ge=-1, le=1)] = 0.1
    """Relative change over the image's full height."""
    clutter: Fraction = 0.0
    """Objects in the room: largest relative contrast of 40 rectangles against their background."""
    flicker_depth: Fraction = 0.1
    mains_hz: Annotated[float, within(1, 10_000, "hertz")] = 60.0
    """Mains frequency; light flickers at twice this."""
    off_jump: Annotated[float, within(-1, 1000, "relative to the room light")] = 0.0
    """Relative change of the ambient light while no laser is on."""


class StreamSpec(FileModel):
    """Exposure and transfer of frames."""

    exposure_s: Seconds | None = None
    """Fixed exposure; None: metered at every placement."""
    gain: Annotated[float, within(1, 1000, "1 at the full well")] = 1.0
    metered_peak: Annotated[float, Field(gt=0, lt=1)] = 0.7
    """Brightest pixel after metering, as a fraction of full scale."""
    shortest_exposure_s: Seconds = 2e-6
    longest_exposure_s: Seconds = 0.033
    mirrored: bool = False
    """Whether left and right are exchanged."""
    latency_frames: Annotated[int, within(0, 1000, "frames")] = 0
    """Number of frames between a laser command and the first frame that shows it."""
    dropped: Annotated[float, Field(ge=0, le=0.9)] = 0.0
    """Share of frames that are lost in transfer."""
    repeated: Annotated[float, Field(ge=0, le=0.9)] = 0.0
    """Share of frames that are replaced by the previous one."""


class WarmUpSpec(FileModel):
    """Drift of the focal length: f (1 + relative exp(-frames / time constant)). Off by default."""

    f_relative: Annotated[float, Field(gt=-0.5, lt=0.5)] = 0.0
    time_constant_frames: Annotated[float, within(1e-3, 1e9, "frames")] = 2000.0


class DriftSpec(FileModel):
    """Steady shift of the image, as of a mount that creeps. Counts frames since the bench was opened."""

    u_px_per_frame: PixelsPerFrame = 0.0
    v_px_per_frame: PixelsPerFrame = 0.0


class SurfaceSpec(FileModel):
    """Surface finishes of targets."""

    albedo: Fraction = 0.8
    """Diffuse reflectance of paper."""
    absorbent_albedo: Fraction = 0.01
    ink_albedo: Fraction = 0.04
    """Diffuse reflectance of black parts of the printed board."""
    mirror_albedo: Fraction = 0.05
    """Diffuse reflectance of a mirror-like target (dust, scratches)."""
    mirror_reflectance: Fraction = 0.8
    wall_behind_mm: Annotated[float, within(1, 1e6, "millimetres")] = 1500.0
    """Distance from the pinhole back to the wall that is visible in a mirror-like target."""


class LaserTruth(FileModel):
    """Pinned values of one laser."""

    x_mm: Pinned | None = None
    y_mm: Pinned | None = None
    tx: PinnedSlope | None = None
    ty: PinnedSlope | None = None


class PlacementTruth(FileModel):
    """Pinned errors of one placement."""

    error_mm: Pinned | None = None
    yaw_deg: TiltAngle | None = None
    pitch_deg: TiltAngle | None = None


class TruthSpec(FileModel):
    """Values that are pinned instead of drawn from the rig's priors."""

    f_px: Annotated[float, within(1, LARGEST, "pixels")] | None = None
    cx_px: Pinned | None = None
    cy_px: Pinned | None = None
    k1: PinnedCoefficient | None = None
    k2: PinnedCoefficient | None = None
    p1: PinnedCoefficient | None = None
    p2: PinnedCoefficient | None = None
    k3: PinnedCoefficient | None = None
    k4: PinnedCoefficient | None = None
    offset_mm: Pinned | None = None
    ruler_scale: PinnedScale | None = None
    target_yaw_deg: TiltAngle | None = None
    target_pitch_deg: TiltAngle | None = None
    print_scale: PinnedScale | None = None
    bow_x_mm: Pinned | None = None
    bow_y_mm: Pinned | None = None
    bow_xy_mm: Pinned | None = None
    lasers: dict[str, LaserTruth] = Field(default_factory=dict)
    placements: dict[str, PlacementTruth] = Field(default_factory=dict)


class ControllerSpec(FileModel):
    """Laser controller and its fault."""

    fault: Fault = "none"
    interlock_closed: bool = True


class EmulatorSpec(FileModel):
    """Block `emulator:` of the rig file."""

    seed: Annotated[int, within(0, 2**64 - 1, "64 bits")]
    beam: BeamSpec = BeamSpec()
    lens: LensSpec = LensSpec()
    sensor: SensorSpec = SensorSpec()
    ambient: AmbientSpec = AmbientSpec()
    camera: StreamSpec = StreamSpec()
    warm_up: WarmUpSpec = WarmUpSpec()
    drift: DriftSpec = DriftSpec()
    surface: SurfaceSpec = SurfaceSpec()
    truth: TruthSpec = TruthSpec()
    controller: ControllerSpec = ControllerSpec()
    answers: bool = True
    """Whether the bench answers prompts itself; false lets a person practise."""

    @field_validator("truth")
    @classmethod
    def _is_of_the_rigs_lasers(cls, truth: TruthSpec, info: ValidationInfo) -> TruthSpec:
        known = info.context.laser_ids if isinstance(info.context, Rig) else truth.lasers
        if unknown := [name for name in truth.lasers if name not in known]:
            raise ValueError(f"lasers.{unknown[0]}: expected a laser of the rig ({', '.join(known)})")
        return truth

    @field_validator("truth")
    @classmethod
    def _is_of_the_rigs_lens(cls, truth: TruthSpec, info: ValidationInfo) -> TruthSpec:
        if not isinstance(info.context, Rig):
            return truth
        lens = info.context.camera.lens
        others = set(chain(*COEFFICIENTS.values())).difference(COEFFICIENTS[lens])
        if wrong := sorted(others & truth.model_fields_set):
            raise ValueError(
                f"{wrong[0]}: expected coefficients of the rig's lens {lens}"
                f" ({', '.join(COEFFICIENTS[lens])})"
            )
        return truth


def emulator_spec(rig: Rig) -> EmulatorSpec:
    """Validate the rig's `emulator:` block.

    Raises:
        BadInputError: the block is wrong; one line for each problem with key, expected and actual value.
    """
    if (pixels := rig.camera.width_px * rig.camera.height_px) > MOST_PIXELS:
        raise BadInputError(
            f"rig {rig.rig}: camera: expected at most {MOST_PIXELS} pixels on the virtual bench, got {pixels}"
        )
    block: dict[str, Any] = {} if rig.emulator is None else rig.emulator
    try:
        return EmulatorSpec.model_validate(block, context=rig)
    except ValidationError as error:
        found = problems(EmulatorSpec, block, error.errors())
        lines = [f"rig {rig.rig}: emulator.{one.message}" for one in found]
        raise BadInputError("\n".join(lines)) from None
