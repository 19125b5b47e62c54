"""Questions of `workbench new` about a sensor, and the numbers in their answers."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import atan, degrees, hypot, isfinite, radians, tan
from typing import Literal

from workbench.cli.dialogue import Question
from workbench.cli.found_devices import FoundDevice
from workbench.model.problems import THOUSANDS
from workbench.model.rig import FEWEST_PX, UNKNOWN_SERIAL
from workbench.model.text_length import LONGEST_NAME

LASER_CLASSES = ("1", "1M", "2", "2M", "3R", "3B", "4")
MEASURED_SD_MM = {"calliper": 0.2, "ruler": 0.5, "drawing": 0.3}
"""Standard deviation of a baseline by its source; a drawing has the tolerances of the parts."""
MOST_LASERS = 20
"""Largest number of lasers that is asked for; a rig file can have more."""
FARTHEST_FIRST_SIGHT_MM = 2000.0
"""Nearest standoff of a visible spot beyond which a baseline is refused as a slip."""
NAME = re.compile(r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")
SIZE = re.compile(r"^(\d+)\s*(?:x|X|\*|×|by|\s)\s*(\d+)$")
QUANTITY = re.compile(r"^([-+]?[\d.,]+(?:[eE][-+]?\d+)?)\s*([A-Za-zµ°]*)$")
BASELINE = re.compile(r"^([-+]?[\d.,]+)(?:mm)?(v?)$")
YES, NO = "yes", "no"
DIAGONAL = "diagonal"

Basis = Literal["focal length", "field of view", "calibrated"]
F_RELATIVE_SD: dict[Basis, float] = {"focal length": 0.05, "field of view": 0.1, "calibrated": 0.02}
"""Relative standard deviation of the focal length in pixels by its source."""


@dataclass(frozen=True)
class Lens:
    """Focal length in pixels and its source."""

    f_px: float
    basis: Basis


@dataclass(frozen=True)
class Beam:
    """One laser: its distance from the optical axis along the image axis u (right) or v (down)."""

    baseline_mm: float
    axis: Literal["u", "v"]


def sensor_questions(
    cameras: Sequence[FoundDevice], ports: Sequence[FoundDevice], taken: Sequence[str]
) -> list[Question]:
    """Questions about a sensor.

    Args:
        cameras: cameras of this computer.
        ports: serial ports of this computer.
        taken: names of rig files that exist in the new folder.
    """
    return [
        Question(
            "name",
            "Name of the sensor?",
            "Letters, digits, _ . and -; the rig file gets this name.",
            lambda text, _: parse_name(text, taken),
            "my-sensor",
        ),
        Question(
            "serial",
            "Serial number of the sensor?",
            "On its label. Calibrations, verifications and history are filed under it: no other sensor may"
            " have the same. Without a label, take the default and write it on the sensor.",
            lambda text, _: parse_serial(text),
            default_serial(),
        ),
        Question(
            "camera",
            "Camera?",
            f"{_listed(cameras, 'camera')} Path of a device, or address of a stream.",
            _in_words("a device such as /dev/video0, or an address"),
            cameras[0].path if cameras else "/dev/video0",
        ),
        Question("size", "Size of its images, in pixels?", "Width x height, such as 1280 x 720.", _size),
        Question(
            "pitch",
            "Pixel pitch, in um?",
            "Distance of two pixels in that image, from the data sheet of the image sensor. Twice as much"
            " where the camera joins pixels in pairs (binning).",
            lambda text, _: parse_quantity(text, "um", 0.5, 50),
            echo=lambda text: f"{parse_quantity(text, 'um', 0.5, 50):g} um",
        ),
        Question(
            "lens",
            "Focal length, or horizontal field of view?",
            "From the lens's data sheet: 4 mm, or 60 deg. Of a webcam: 78 deg diagonal.",
            parse_lens,
        ),
        Question(
            "f_number",
            "f-number of the lens?",
            "Focal length over aperture: 2 for f/2.",
            lambda text, _: parse_quantity(text.lower().removeprefix("f/"), "", 0.7, 32),
        ),
        Question(
            "wavelength",
            "Wavelength of the lasers, in nm?",
            "On their label: 650 is red, 520 green.",
            lambda text, _: parse_quantity(text, "nm", 350, 1100),
            echo=lambda text: f"{parse_quantity(text, 'nm', 350, 1100):g} nm",
        ),
        Question(
            "baselines",
            "Distances of the laser beams from the camera's optical axis, in mm?",
            "One for each laser, in the order of the controller's lines. Seen from behind the camera,"
            " positive is right: -60 30 60. A v marks a laser below (positive) or above (negative): -40v.",
            parse_baselines,
        ),
        Question(
            "measured",
            "How were these distances measured?",
            "calliper (0.2 mm), drawing (0.3 mm), ruler (0.5 mm), or a standard uncertainty such as 0.1 mm.",
            lambda text, _: parse_baseline_sd(text),
            "calliper",
            baseline_sd_text,
        ),
        Question(
            "laser_class",
            "Class of the lasers (IEC 60825-1)?",
            f"On their label: {', '.join(LASER_CLASSES)}. Of several, the most dangerous. It has no default.",
            lambda text, _: parse_laser_class(text),
        ),
        Question(
            "port",
            "Serial port of the laser controller?",
            f"{_listed(ports, 'serial port')} An Arduino Uno is usually /dev/ttyACM0.",
            _in_words("a serial port such as /dev/ttyACM0"),
            ports[0].path if ports else "/dev/ttyACM0",
        ),
        Question(
            "practise",
            "Also a virtual bench of this sensor, to practise?",
            "yes or no. It asks for the target as a real bench does, and needs no hardware.",
            lambda text, _: parse_yes(text),
            YES,
        ),
    ]


def parse_name(text: str, taken: Sequence[str] = ()) -> str:
    """Name of a rig.

    Raises:
        ValueError: it cannot be the name of a file, or is taken.
    """
    if not NAME.match(text) or len(text) > 60:
        raise ValueError(f"expected up to 60 letters, digits, _ . and -, got {text or 'nothing'}")
    if text in taken:
        raise ValueError(f"expected a new name, got {text}: the folder will contain an example of this name")
    return text


def default_serial() -> str:
    """Serial number that no other folder's sensor has: the present time, to the second."""
    return time.strftime("%Y%m%d-%H%M%S", time.localtime())


def parse_serial(text: str) -> str:
    """Serial number of a sensor.

    Raises:
        ValueError: it is blank, too long, or the word for an unknown one.
    """
    if not text or len(text) > LONGEST_NAME or text == UNKNOWN_SERIAL:
        raise ValueError(
            f"expected a serial number of up to {LONGEST_NAME} characters, got {text or 'nothing'}"
        )
    return text


def parse_size(text: str) -> tuple[int, int]:
    """Width and height of an image.

    Raises:
        ValueError: they are not two numbers of pixels of a camera.
    """
    found = SIZE.match(text.removesuffix("px").strip())
    if found is None:
        raise ValueError(f"expected width x height, such as 1280 x 720, got {text or 'nothing'}")
    width, height = int(found[1]), int(found[2])
    if not (min(width, height) >= FEWEST_PX and max(width, height) <= 10_000):
        raise ValueError(f"expected {FEWEST_PX} to 10000 pixels in each direction, got {width} x {height}")
    if height > 2 * width:
        raise ValueError(f"expected the width first, got {width} x {height}")
    return width, height


def parse_quantity(text: str, unit: str, low: float, high: float) -> float:
    """Number with or without its unit.

    Raises:
        ValueError: no number, another unit, or outside `low` to `high`.
    """
    value, given = _number(text)
    if given not in ("", unit):
        raise ValueError(f"expected {unit or 'a number without unit'}, got {given}")
    if not low <= value <= high:
        raise ValueError(f"expected {low:g} to {high:g} {unit}, got {value:g}".replace("  ", " "))
    return value


def parse_lens(text: str, given: Mapping[str, str]) -> Lens:
    """Focal length in pixels from `4 mm`, `60 deg`, `78 deg diagonal` or `900 px`.

    Args:
        text: answer.
        given: answers with the keys `size` and `pitch`.

    Raises:
        ValueError: no such quantity, or a horizontal field of view outside 5 to 120 degrees.
    """
    value, unit = _number(text.lower().removesuffix(DIAGONAL))
    width_px, height_px = parse_size(given["size"])
    seen_px = hypot(width_px, height_px) if text.lower().endswith(DIAGONAL) else width_px
    if unit == "mm":
        lens = Lens(value * 1000 / parse_quantity(given["pitch"], "um", 0.5, 50), "focal length")
    elif unit in {"deg", "°"}:
        if not 5 <= value <= 120:
            raise ValueError(f"expected a field of view of 5 to 120 deg, got {value:g} deg")
        lens = Lens(seen_px / 2 / tan(radians(value / 2)), "field of view")
    elif unit == "px":
        lens = Lens(value, "calibrated")
    else:
        raise ValueError(f"expected a number with mm or deg, such as 4 mm or 60 deg, got {text or 'nothing'}")
    view_deg = 2 * degrees(atan(width_px / 2 / lens.f_px)) if lens.f_px > 0 else 180.0
    if not 5 <= round(view_deg, 6) <= 120:
        raise ValueError(
            f"expected a lens that sees 5 to 120 deg horizontally, got {view_deg:.3g} deg from {text} with"
            f" {given['pitch']} um pixels and images {width_px} px wide; correct this answer, or type back"
        )
    return lens


def parse_baselines(text: str, given: Mapping[str, str]) -> list[Beam]:
    """Lasers from distances such as `-60 30 60 -40v`.

    Args:
        text: answer.
        given: answers with the keys `size`, `pitch` and `lens`.

    Raises:
        ValueError: no distances, one of 0, two equal ones, or one whose spot is seen from afar only.
    """
    words = [word.strip(",;") for word in re.sub(r"\s*mm\b", "", text).split()]
    if joined := [word for word in words if re.search("[,;]", word)]:
        raise ValueError(f"expected spaces between distances and a decimal point, got {joined[0]}")
    if not 1 <= len(words) <= MOST_LASERS:
        raise ValueError(f"expected 1 to {MOST_LASERS} distances in mm, such as -60 30 60, got {len(words)}")
    beams = [_beam(word) for word in words]
    if twice := [word for n, word in enumerate(words) if beams[n] in beams[:n]]:
        raise ValueError(f"expected a different distance for each laser, got {twice[0]} twice")
    for beam in beams:
        if (nearest := nearest_mm(beam, given)) > FARTHEST_FIRST_SIGHT_MM:
            raise ValueError(
                f"expected millimetres from the optical axis, got {beam.baseline_mm:g}: the spot of such a"
                f" laser would be outside the image up to {nearest:.0f} mm from the camera"
            )
    return beams


def nearest_mm(beam: Beam, given: Mapping[str, str]) -> float:
    """Nearest distance at which the spot of a beam parallel to the optical axis is in the image."""
    side_px = parse_size(given["size"])["uv".index(beam.axis)]
    return parse_lens(given["lens"], given).f_px * abs(beam.baseline_mm) / (side_px / 2)


def parse_baseline_sd(text: str) -> float:
    """Standard deviation of the baselines, mm.

    Raises:
        ValueError: neither a known way to measure nor a length.
    """
    if (sd_mm := MEASURED_SD_MM.get(text.lower())) is not None:
        return sd_mm
    try:
        return parse_quantity(text, "mm", 0.001, 50)
    except ValueError as error:
        ways = ", ".join(MEASURED_SD_MM)
        raise ValueError(f"expected {ways}, or a standard uncertainty in mm: {error}") from None


def baseline_sd_text(text: str) -> str:
    """Valid answer for `parse_baseline_sd` with its unit: `calliper`, or `1 mm (1 sigma), as answered`."""
    if (known := text.lower()) in MEASURED_SD_MM:
        return known
    return f"{parse_baseline_sd(text):g} mm (1 sigma), as answered"


def parse_laser_class(text: str) -> str:
    """Laser class by IEC 60825-1.

    Raises:
        ValueError: no such class; also an older class in Roman numerals, whose limits differ.
    """
    upper = text.upper().removeprefix("CLASS").strip()
    if upper in LASER_CLASSES:
        return upper
    hint = ""
    if upper in {"3A", "IIIA"}:
        hint = "; 3a and IIIa are of an older standard: such a laser of 1 to 5 mW, visible, is mostly 3R now"
    elif upper in {"I", "II", "IIIB", "IV", "3"}:
        hint = "; this is of another standard: find the class by IEC 60825-1 in the data sheet"
    raise ValueError(f"expected one of {', '.join(LASER_CLASSES)}, got {text or 'nothing'}{hint}")


def parse_yes(text: str) -> bool:
    """Whether the answer is yes.

    Raises:
        ValueError: neither yes nor no.
    """
    if text.lower() not in (YES, NO):
        raise ValueError(f"expected yes or no, got {text}")
    return text.lower() == YES


def _beam(word: str) -> Beam:
    found = BASELINE.match(word)
    if found is None:
        raise ValueError(f"expected distances in mm, such as -60 30 60, got {word}")
    value, _ = _number(found[1])
    if not 1 <= abs(value) <= 2000:
        raise ValueError(f"expected 1 to 2000 mm to either side, got {word}: on the axis no spot moves")
    return Beam(value, "v" if found[2] else "u")


def _number(text: str) -> tuple[float, str]:
    """Number and unit of an answer; a decimal comma is read."""
    found = QUANTITY.match(text.strip())
    if found is None:
        raise ValueError(f"expected a number, got {text or 'nothing'}")
    if THOUSANDS.match(found[1]):
        raise ValueError(f"expected a number without thousands separator, got {text}")
    try:
        value = float(found[1].replace(",", "."))
    except ValueError:
        raise ValueError(f"expected a number, got {text}") from None
    if not isfinite(value):
        raise ValueError(f"expected a number, got {text}")
    return value, found[2].replace("µ", "u")


def _size(text: str, _: Mapping[str, str]) -> object:
    return parse_size(text)


def _in_words(expected: str) -> Callable[[str, Mapping[str, str]], object]:
    def check(text: str, _: Mapping[str, str]) -> object:
        if not text or any(character.isspace() for character in text):
            raise ValueError(f"expected {expected}, without spaces, got {text or 'nothing'}")
        return text

    return check


def _listed(devices: Sequence[FoundDevice], what: str) -> str:
    if not devices:
        return f"No {what} was found on this computer; the answer can be changed in the rig file later."
    return "Found: " + ", ".join(f"{device.path} ({device.name})" for device in devices) + "."
