"""Rig file of a sensor from the answers of `workbench new`, with comments on every number."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import ceil
from pathlib import Path

from workbench.cli.sensor_questions import (
    F_RELATIVE_SD,
    Beam,
    Lens,
    baseline_sd_text,
    nearest_mm,
    parse_baseline_sd,
    parse_baselines,
    parse_laser_class,
    parse_lens,
    parse_quantity,
    parse_size,
)
from workbench.model.speckle import speckle_sd_px

CENTRE_SHARE = 1 / 16
"""Standard deviation of the principal point over the image width: the thesis's was 39 of 640 px off."""
LEAST_REACH_MM = 100.0
FARTHEST_MM = 5000.0
"""Reach of the bench; only `workbench design` uses it."""
LEAST_ACROSS_SD_MM = 0.5
"""Smallest standard deviation of a beam's position across its baseline, which is rarely measured."""
COMMENTS_AT = 42
"""Column of comments."""
SPOILT_KEY, SPOILT_MM = "calibrate-flat.2/600mm", 25
"""Placement that the comment for practising a repair spoils, and its error."""


@dataclass(frozen=True)
class Sensor:
    """Sensor as the answers describe it."""

    name: str
    serial: str
    camera: str
    width_px: int
    height_px: int
    pitch_um: float
    lens: Lens
    lens_text: str
    f_number: float
    wavelength_nm: float
    beams: tuple[Beam, ...]
    baseline_sd_mm: float
    measured: str
    laser_class: str
    port: str
    nearest_mm: float
    """Nearest standoff at which the spot of any laser is in the image."""

    @classmethod
    def of(cls, given: Mapping[str, str]) -> Sensor:
        """Sensor from valid answers by the keys of `sensor_questions`."""
        beams = parse_baselines(given["baselines"], given)
        width, height = parse_size(given["size"])
        return cls(
            name=given["name"],
            serial=given["serial"],
            camera=given["camera"],
            width_px=width,
            height_px=height,
            pitch_um=parse_quantity(given["pitch"], "um", 0.5, 50),
            lens=parse_lens(given["lens"], given),
            lens_text=given["lens"],
            f_number=parse_quantity(given["f_number"].lower().removeprefix("f/"), "", 0.7, 32),
            wavelength_nm=parse_quantity(given["wavelength"], "nm", 350, 1100),
            beams=tuple(beams),
            baseline_sd_mm=parse_baseline_sd(given["measured"]),
            measured=baseline_sd_text(given["measured"]),
            laser_class=parse_laser_class(given["laser_class"]),
            port=given["port"],
            nearest_mm=min(nearest_mm(beam, given) for beam in beams),
        )


def rig_text(sensor: Sensor) -> str:
    """Rig file of the real sensor, for separate devices."""
    head = (
        f"# {sensor.name}: written by `workbench new`. Every `sd` is one standard deviation of what is known",
        "# before the calibration; correct what is known better. All keys: docs/rig-format.md.",
    )
    return "\n".join((*head, *_named(sensor, sensor.name), *_devices(sensor), *_described(sensor))) + "\n"


def practice_text(sensor: Sensor, seed: int) -> str:
    """Rig file of the same sensor on the virtual bench, which leaves the prompts to a person."""
    head = (
        f"# {sensor.name} on the virtual bench, to practise without hardware. The bench draws a true sensor",
        "# from the priors below, and places its target at the standoff that is entered.",
    )
    named = _named(sensor, practice_name(sensor.name))
    lines = (*head, *named, "driver: emulated", "", *_described(sensor), *_emulator(sensor, seed))
    return "\n".join(lines) + "\n"


def practice_name(name: str) -> str:
    """Name of the rig on the virtual bench."""
    return f"{name}-practice"


def paths(sensor: Sensor, folder: Path) -> tuple[Path, Path]:
    """Rig files of the sensor, real and to practise, in the folder of the laboratory."""
    rigs = folder / "rigs"
    return rigs / f"{sensor.name}.yaml", rigs / f"{practice_name(sensor.name)}.yaml"


def _named(sensor: Sensor, name: str) -> Iterator[str]:
    yield "format: 1"
    yield f"rig: {_quoted(name)}"
    serial = sensor.serial if name == sensor.name else practice_name(sensor.serial)
    yield _noted(f"serial: {_quoted(serial)}", "of this sensor; its calibration is refused for another")
    yield _noted(f'laser_class: "{sensor.laser_class}"', "IEC 60825-1, of the most dangerous laser")


def _devices(sensor: Sensor) -> Iterator[str]:
    yield from (
        "driver: opencv+serial",
        "devices:",
        "  camera:",
        "    driver: opencv",
        f"    source: {_quoted(sensor.camera)}",
        _noted("    # pixel_format: GREY", "v4l2-ctl --list-formats-ext lists what the camera has"),
        _noted("    exposure: 50", "V4L2: units of 100 us; turns automatic exposure off"),
        _noted("    exposure_limits: [1, 300]", "v4l2-ctl --list-ctrls prints those of the camera"),
        _noted("    # gain: 0", "the lowest that the camera has"),
        _noted("    latency_frames: 3", "workbench doctor measures it"),
        "  lasers:",
        "    driver: serial",
        f"    port: {_quoted(sensor.port)}",
        "  target:",
        "    driver: by_hand",
        "",
    )


def _described(sensor: Sensor) -> Iterator[str]:
    yield from _camera(sensor)
    yield from _lasers(sensor)
    yield from _bench_and_noise(sensor)


def _camera(sensor: Sensor) -> Iterator[str]:
    f_px, relative = sensor.lens.f_px, F_RELATIVE_SD[sensor.lens.basis]
    centre_sd = max(5.0, sensor.width_px * CENTRE_SHARE)
    yield from (
        "camera:",
        f"  width_px: {sensor.width_px}",
        f"  height_px: {sensor.height_px}",
        "  bits: 8",
        _noted(
            f"  f_px: {_prior(f_px, f_px * relative, 1)}",
            f"{sensor.lens_text}, {sensor.pitch_um:g} um a pixel; known to {100 * relative:g} %",
        ),
        _noted(f"  cx_px: {_prior((sensor.width_px - 1) / 2, centre_sd, 1)}", "lenses are off the centre"),
        f"  cy_px: {_prior((sensor.height_px - 1) / 2, centre_sd, 1)}",
        _noted("  k1: {value: 0.0, sd: 0.3}", "distortion, unknown"),
        "  k2: {value: 0.0, sd: 0.3}",
        "",
    )


def _lasers(sensor: Sensor) -> Iterator[str]:
    yield _noted("lasers:", "the first is on line 1 of the controller, and so on")
    sd = sensor.baseline_sd_mm
    for number, beam in enumerate(sensor.beams, start=1):
        along, across = _prior(beam.baseline_mm, sd, 2), _prior(0.0, max(sd, LEAST_ACROSS_SD_MM), 2)
        x, y = (along, across) if beam.axis == "u" else (across, along)
        yield from (
            f"  - id: L{number}",
            f"    axis: {beam.axis}",
            _noted(f"    x_mm: {x}", f"measured: {sensor.measured}"),
            f"    y_mm: {y}",
            _noted("    tx: {value: 0.0, sd: 0.005}", "aligned by eye: 5 mm in a metre"),
            "    ty: {value: 0.0, sd: 0.005}",
        )
    yield ""


def _bench_and_noise(sensor: Sensor) -> Iterator[str]:
    nearest = max(LEAST_REACH_MM, 10.0 * ceil(1.1 * sensor.nearest_mm / 10))
    speckle = speckle_sd_px(sensor.wavelength_nm, sensor.f_number, sensor.pitch_um)
    optics = f"{sensor.wavelength_nm:g} nm, f/{sensor.f_number:g}, {sensor.pitch_um:g} um"
    yield from (
        "bench:",
        _noted("  offset_mm: {value: 0.0, sd: 5.0}", "pinhole behind the plane where standoffs begin"),
        _noted("  ruler_scale: {value: 0.0, sd: 0.0005}", "tape of class II: 0.5 mm in a metre"),
        _noted("  placement_sd_mm: 0.5", "target placed by hand at the ruler's mark"),
        _noted("  tilt_sd_deg: 0.5", "of the target at each placement"),
        _noted("  target_tilt_sd_deg: 0.5", "of the rail, at all placements"),
        _noted(f"  reach_mm: [{nearest:g}, {FARTHEST_MM:g}]", "nearer, no spot is in the image"),
        "",
        "noise:",
        "  spot_sd_px: 0.1",
        _noted(f"  speckle_sd_px: {speckle:.3f}", f"{optics}: docs/spots.md"),
    )


def _emulator(sensor: Sensor, seed: int) -> Iterator[str]:
    yield from (
        "",
        "emulator:",
        _noted(f"  seed: {seed}", "another number is another sensor"),
        _noted("  answers: false", "a person answers the prompts"),
        f"  beam: {{wavelength_nm: {sensor.wavelength_nm:g}}}",
        f"  lens: {{f_number: {sensor.f_number:g}}}",
        f"  sensor: {{pitch_um: {sensor.pitch_um:g}}}",
        "  # To practise a repair, remove the # in front of truth. The target then stands",
        f"  # {SPOILT_MM} mm off at 600 mm, the first time that it is placed there.",
        f"  # truth: {{placements: {{{SPOILT_KEY}: {{error_mm: {SPOILT_MM}}}}}}}",
    )


def _noted(text: str, comment: str) -> str:
    """Line with a comment in the column of comments."""
    return f"{text:<{COMMENTS_AT}}# {comment}"


def _quoted(text: str) -> str:
    """Text in double quotes for YAML, readable in any script."""
    return json.dumps(text, ensure_ascii=False)


def _prior(value: float, sd: float, decimals: int) -> str:
    return f"{{value: {value:.{decimals}f}, sd: {float(f'{sd:.2g}'):g}}}"
