"""Hidden truth of a virtual bench: drawn from its seed, and written to a file that only tests read."""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass
from io import StringIO
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.random import Generator
from ruamel.yaml import YAML

from workbench.emulator.keyed import generator
from workbench.emulator.spec import EmulatorSpec, LaserTruth, PlacementTruth
from workbench.model.board import BOW
from workbench.model.errors import BadInputError
from workbench.model.head_spec import HeadSpec
from workbench.model.lens import COEFFICIENTS, LensName
from workbench.model.prior import Prior
from workbench.model.rig import CameraSpec, Rig
from workbench.model.yamlfile import FileModel

BOARD_SHIFT_SD_MM = 2.0
BOARD_ROLL_SD_DEG = 1.0
"""Errors of placing the blank band on the spots by hand, 1 sigma."""
RADIAL: dict[LensName, tuple[str, ...]] = {
    "plumb_bob": ("k1", "k2", "k3"),
    "equidistant": ("k1", "k2", "k3", "k4"),
}
"""Coefficients of the radial polynomial 1 + k1 a^2 + k2 a^4 + ..."""
WIDEST_RAD = np.radians(88.0)
"""Largest angle to the axis in the image of the bench's fisheye."""


@dataclass(frozen=True)
class TrueRay:
    """True laser ray: origin (x, y, 0) mm, direction (tx, ty, 1), camera frame."""

    x_mm: float
    y_mm: float
    tx: float
    ty: float


@dataclass(frozen=True)
class TrueHead:
    """True values of a scanning head, as in the rig file; the laser's ray has axis, zero and inclination."""

    laser: str
    axis_z_mm: float
    axis_slope_x: float
    axis_slope_z: float
    beam_offset_mm: float
    scale: float
    eccentricity_cos_deg: float
    """Error of the encoder, a (cos(reading) - 1) + b sin(reading): a."""
    eccentricity_sin_deg: float
    """b"""
    reading_sd_deg: float


@dataclass(frozen=True)
class PlacementError:
    """Error of a placement along the axis, and tilts of a flat target about its two axes."""

    error_mm: float
    yaw_deg: float
    pitch_deg: float


@dataclass(frozen=True)
class BoardError:
    """Centre of the board's band, and rotation of the board in its plane."""

    x_mm: float
    y_mm: float
    roll_deg: float


@dataclass(frozen=True)
class Truth:
    """True values of the bench, units and frames as in the rig file; unused lens coefficients are 0."""

    f_px: float
    cx_px: float
    cy_px: float
    k1: float
    k2: float
    p1: float
    p2: float
    k3: float
    offset_mm: float
    ruler_scale: float
    lasers: dict[str, TrueRay]
    lens: LensName = "plumb_bob"
    k4: float = 0.0
    target_yaw_deg: float = 0.0
    """This and the next: tilt of a flat target at every placement."""
    target_pitch_deg: float = 0.0
    print_scale: float = 0.0
    bow_x_mm: float = 0.0
    """First of three coefficients of the sag of the board's paper, see `workbench.model.board.sag_mm`."""
    bow_y_mm: float = 0.0
    bow_xy_mm: float = 0.0
    head: TrueHead | None = None


def draw_truth(rig: Rig, spec: EmulatorSpec) -> Truth:
    """Draw every value from its prior in the rig file, unless `emulator.truth` pins it.

    Each value has its own key, so that pinning one does not change the others. Lens coefficients are drawn
    again, all together, while the lens would fold inside the image, which real lenses do not.

    Raises:
        BadInputError: all draws of the lens fold.
    """
    pins = spec.truth
    camera = rig.camera
    bow = Prior(value=0.0, sd=rig.bench.board_flatness_sd_mm)
    focal = {
        name: _value(spec.seed, name, getattr(camera, name), pins) for name in ("f_px", "cx_px", "cy_px")
    }
    return Truth(
        **focal,
        **dict.fromkeys(chain(*COEFFICIENTS.values()), 0.0) | _draw_lens(camera, spec, focal),
        lens=camera.lens,
        offset_mm=_value(spec.seed, "offset_mm", rig.bench.offset_mm, pins),
        ruler_scale=_value(spec.seed, "ruler_scale", rig.bench.ruler_scale, pins),
        target_yaw_deg=_value(spec.seed, "target_yaw_deg", _tilt(rig, rig.bench.target_yaw_deg), pins),
        target_pitch_deg=_value(spec.seed, "target_pitch_deg", _tilt(rig, rig.bench.target_pitch_deg), pins),
        print_scale=_value(spec.seed, "print_scale", rig.bench.print_scale, pins),
        **{name: _value(spec.seed, name, bow, pins) for name in BOW},
        lasers={
            laser.id: TrueRay(
                **{
                    name: _value(
                        spec.seed,
                        name,
                        getattr(laser, name),
                        pins.lasers.get(laser.id, LaserTruth()),
                        laser.id,
                    )
                    for name in ("x_mm", "y_mm", "tx", "ty")
                }
            )
            for laser in rig.lasers
        },
        head=None if rig.head is None else _draw_head(rig.head, spec.seed),
    )


def draw_placement_error(
    rig: Rig,
    spec: EmulatorSpec,
    key: str,
    turn_sds_deg: tuple[float | None, float | None] = (None, None),
    attempt: int = 1,
) -> PlacementError:
    """Errors of the placement `key` itself, equal whenever the same attempt is repeated.

    Args:
        rig: rig with the tolerances of placements.
        spec: settings of the bench.
        key: key of the placement.
        turn_sds_deg: standard deviations of yaw and pitch; None: the rig's `tilt_sd_deg`.
        attempt: number of the attempt; pinned values hold for the first.
    """
    again = () if attempt == 1 else (attempt,)
    error, yaw, pitch = generator(spec.seed, "placement", key, *again).standard_normal(3)
    pins = spec.truth.placements.get(key) if attempt == 1 else None
    pins = pins or PlacementTruth()
    yaw_sd_deg, pitch_sd_deg = (rig.bench.tilt_sd_deg if sd is None else sd for sd in turn_sds_deg)
    return PlacementError(
        error_mm=_pinned(pins.error_mm, rig.bench.placement_sd_mm * error),
        yaw_deg=_pinned(pins.yaw_deg, yaw_sd_deg * yaw),
        pitch_deg=_pinned(pins.pitch_deg, pitch_sd_deg * pitch),
    )


def draw_board_error(truth: Truth, spec: EmulatorSpec, key: str, z_mm: float) -> BoardError:
    """Position of a board placed by hand at depth `z_mm`: its band on the spots, with random errors."""
    spots = np.array([(r.x_mm + r.tx * z_mm, r.y_mm + r.ty * z_mm) for r in truth.lasers.values()])
    x_mm, y_mm = spots.mean(axis=0)
    right, down, roll = generator(spec.seed, "board", key).standard_normal(3)
    return BoardError(
        x_mm=float(x_mm + BOARD_SHIFT_SD_MM * right),
        y_mm=float(y_mm + BOARD_SHIFT_SD_MM * down),
        roll_deg=float(BOARD_ROLL_SD_DEG * roll),
    )


def truth_path(session_dir: Path) -> Path:
    """Path of the truth's file, beside the session folder."""
    return session_dir.with_name(session_dir.name + ".truth.yaml")


class TruthFile:
    """File of the truth: one YAML document, to which every placement adds a line with its errors.

    Opening a session again keeps the placements in its file, if the truth is the same.
    """

    def __init__(self, path: Path, spec: EmulatorSpec, truth: Truth) -> None:
        self._path = path
        text = StringIO()
        stated = {name: value for name, value in asdict(truth).items() if value is not None}
        YAML(typ="safe", pure=True).dump({"seed": spec.seed, **stated}, text)
        head = text.getvalue() + "placements:\n"
        before = path.read_text(encoding="utf-8") if path.exists() else ""
        # A line that a kill interrupted ends without a newline.
        lines = before[len(head) :].splitlines(keepends=True) if before.startswith(head) else []
        lines = [line for line in lines if line.endswith("\n")]
        self._known = {json.loads(line.split(": {")[0].strip()) for line in lines}
        path.parent.mkdir(parents=True, exist_ok=True)
        _replace(path, head + "".join(lines))

    def add(self, key: str, *errors: PlacementError | BoardError) -> None:
        """Append a placement, once for each key."""
        if key in self._known:
            return
        self._known.add(key)
        items = [item for error in errors for item in asdict(error).items()]
        values = ", ".join(f"{name}: {value!r}" for name, value in items)
        with self._path.open("a", encoding="utf-8") as file:
            file.write(f"  {json.dumps(key)}: {{{values}}}\n")


def _replace(path: Path, text: str) -> None:
    """Replace a file atomically: write, sync, rename."""
    part = path.with_name(path.name + ".part")
    with part.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    part.replace(path)


def _draw_lens(camera: CameraSpec, spec: EmulatorSpec, focal: dict[str, float]) -> dict[str, float]:
    names = COEFFICIENTS[camera.lens]
    rngs = {name: generator(spec.seed, "truth", name) for name in names}
    corner = _corner_radius(camera, focal)
    for _ in range(1000):
        lens = {
            name: _pinned(getattr(spec.truth, name), _drawn(rngs[name], getattr(camera, name)))
            for name in names
        }
        if _reaches_corner(camera.lens, lens, corner):
            return lens
    raise BadInputError(
        f"emulator.truth: expected lens coefficients {', '.join(RADIAL[camera.lens])} (pinned, or drawn from"
        " the rig's camera) with a radial curve that increases up to the image corner at"
        f" {corner:.3g} focal lengths; got none in 1000 draws"
    )


def _corner_radius(camera: CameraSpec, focal: dict[str, float]) -> float:
    """Distorted radius of the farthest image corner with a margin of 3 px, in focal lengths."""
    du = max(focal["cx_px"], camera.width_px - 1 - focal["cx_px"]) + 3
    dv = max(focal["cy_px"], camera.height_px - 1 - focal["cy_px"]) + 3
    return float(np.hypot(du, dv)) / focal["f_px"]


def _reaches_corner(name: LensName, lens: dict[str, float], corner: float) -> bool:
    """Whether a (1 + k1 a^2 + k2 a^4 + ...) increases with a slope of at least 0.3 up to the corner.

    The argument a is the undistorted radius of a pinhole lens, or the angle of a fisheye up to 88 degrees.
    """
    a = np.linspace(0.0, 3.0 * corner if name == "plumb_bob" else WIDEST_RAD, 3001)
    powers = [(2 * n, lens[coefficient]) for n, coefficient in enumerate(RADIAL[name], start=1)]
    slope = 1 + sum((n + 1) * k * a**n for n, k in powers)
    height = a * (1 + sum(k * a**n for n, k in powers))
    climbing = np.logical_and.accumulate(slope >= 0.3)
    return bool(np.any(climbing & (height >= corner)))


def _draw_head(head: HeadSpec, seed: int) -> TrueHead:
    eccentricity = Prior(value=0.0, sd=head.eccentricity_sd_deg)
    priors = {
        **{
            name: getattr(head, name)
            for name in ("axis_z_mm", "axis_slope_x", "axis_slope_z", "beam_offset_mm", "scale")
        },
        **dict.fromkeys(("eccentricity_cos_deg", "eccentricity_sin_deg"), eccentricity),
    }
    drawn = {name: _drawn(generator(seed, "truth", "head", name), prior) for name, prior in priors.items()}
    return TrueHead(laser=head.laser, reading_sd_deg=head.reading_sd_deg, **drawn)


def _tilt(rig: Rig, measured_deg: float) -> Prior:
    return Prior(value=measured_deg, sd=rig.bench.target_tilt_sd_deg)


def _value(seed: int, name: str, prior: Prior, pins: FileModel, *owner: str) -> float:
    return _pinned(getattr(pins, name), _drawn(generator(seed, "truth", *owner, name), prior))


def _drawn(rng: Generator, prior: Prior) -> float:
    return prior.value + prior.sd * float(rng.standard_normal())


def _pinned(pin: float | None, drawn: float) -> float:
    return float(drawn) if pin is None else float(pin)
