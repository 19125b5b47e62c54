"""The example ranger in C gives the ranges of the workbench's ranger."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import workbench as wb
from tests.consumers.c_ranger import build, read_grey, run, spot_lines, write_pgm
from tests.consumers.calibrations import RIGS, calibration_with
from tests.support.reference_session import REFERENCE
from workbench.calibration.verdict.export import render
from workbench.model.arrays import FloatArray
from workbench.model.calibration import load_calibration
from workbench.sensor.calibrated import CalibratedSensor

SAME = 1e-6
"""Largest relative difference of a range from the workbench's."""
CALIBRATION = REFERENCE / "calibration.yaml"


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(tmp_path_factory.mktemp("double"))


def drawn_spots(sensor: CalibratedSensor, seed: int) -> tuple[list[str], FloatArray, FloatArray]:
    """Lasers, noisy positions (500, 2) and deviations (500, 2) of spots, some beyond the valid ranges."""
    rng = np.random.default_rng(seed)
    lasers = [sensor.ids[n] for n in rng.integers(len(sensor.ids), size=500)]
    nearest, farthest = sensor.calibration.laser_ranger.validity.standoff_mm
    range_mm = np.exp(rng.uniform(np.log(0.8 * nearest), np.log(1.5 * farthest), size=500))
    exact = np.array([sensor.spot_px(one, np.array([z]))[0] for one, z in zip(lasers, range_mm, strict=True)])
    sd = rng.uniform(0.01, 0.2, (500, 2))
    return lasers, exact + sd * rng.normal(size=(500, 2)), sd


@pytest.mark.long_cases
@pytest.mark.parametrize("lens", RIGS)
def test_ranges_of_spots_are_those_of_the_workbench(lens: str, program: Path, tmp_path: Path) -> None:
    calibration = calibration_with(lens)
    path = tmp_path / "calibration.yaml"
    path.write_text(render(calibration))
    sensor = CalibratedSensor(calibration)
    lasers, position_px, sd_px = drawn_spots(sensor, seed=5)
    ours = sensor.ranges(lasers, position_px, sd_px, np.zeros_like(sd_px))

    ended = run(program, path, given=spot_lines(lasers, position_px, sd_px))

    assert (ended.returncode, ended.stderr) == (0, "")
    rows = [line.split()[:3] for line in ended.stdout.splitlines()]
    assert [row[0] for row in rows] == lasers
    expected = np.where(np.isfinite(ours.range_mm) & (ours.range_mm > 0), ours.range_mm, np.nan)
    found = np.array([np.nan if row[1] == "-" else float(row[1]) for row in rows])
    np.testing.assert_allclose(found, expected, rtol=SAME)
    assert np.isfinite(found).mean() > 0.9
    good = np.isfinite(found)
    stated = np.array([np.nan if row[2] == "-" else float(row[2]) for row in rows])
    np.testing.assert_allclose(stated[good], ours.spot_sd_mm[good], rtol=6e-3)  # three digits are printed


def test_a_pair_of_frames_gives_the_ranges_of_the_workbench(program: Path, tmp_path: Path) -> None:
    """Within the spots' deviation: the workbench fits profiles to them, the example takes their centroid."""
    ranger = wb.Ranger(wb.load_calibration(CALIBRATION))
    errors_sd: list[float] = []
    for row in pd.read_csv(REFERENCE / "trial-captures.csv").itertuples():
        on, off = read_grey(REFERENCE / str(row.on)), read_grey(REFERENCE / str(row.off))
        reading = ranger.range(on, off)
        paths = write_pgm(tmp_path / "on.pgm", on), write_pgm(tmp_path / "off.pgm", off)

        ended = run(program, CALIBRATION, *paths)

        assert (ended.returncode, ended.stderr) == (0, "")
        found = {line.split()[0]: line.split() for line in ended.stdout.splitlines()}
        assert set(found) == {"L1", "L2"}
        errors_sd += [
            (float(found[one.laser_id][1]) - one.range_mm) / float(found[one.laser_id][2])
            for one in reading.lasers
        ]
    assert len(errors_sd) >= 10
    assert np.max(np.abs(errors_sd)) < 3.0
    assert np.sqrt(np.mean(np.square(errors_sd))) < 1.0


def test_a_single_laser_is_ranged_by_its_brightest_spot(program: Path, tmp_path: Path) -> None:
    row = pd.read_csv(REFERENCE / "captures.csv").iloc[0]
    paths = [write_pgm(tmp_path / f"{n}.pgm", read_grey(REFERENCE / row[n])) for n in ("on", "off")]

    ended = run(program, CALIBRATION, *paths, str(row.laser_id))

    laser, range_mm, sd_mm, *_ = ended.stdout.split()
    assert (ended.returncode, laser) == (0, row.laser_id)
    assert float(range_mm) == pytest.approx(row.standoff_mm, abs=max(10 * float(sd_mm), 3.0))


def test_with_single_precision_ranges_are_within_a_hundredth_of_their_deviation(tmp_path: Path) -> None:
    """As on an AVR, whose double has four bytes."""
    program = build(tmp_path, "-DRANGER_REAL=float", "-Wno-conversion", "-Wno-float-conversion")
    sensor = CalibratedSensor(load_calibration(CALIBRATION))
    lasers, position_px, sd_px = drawn_spots(sensor, seed=6)
    ours = sensor.ranges(lasers, position_px, sd_px, np.zeros_like(sd_px))

    ended = run(program, CALIBRATION, given=spot_lines(lasers, position_px, sd_px))

    rows = [line.split() for line in ended.stdout.splitlines()]
    found = np.array([np.nan if row[1] == "-" else float(row[1]) for row in rows])
    both = np.isfinite(found) & np.isfinite(ours.range_mm)
    assert both.mean() > 0.9
    assert (np.abs(found - ours.range_mm) / ours.spot_sd_mm)[both].max() < 0.01


DAMAGES: dict[str, Callable[[str], str]] = {
    "empty": lambda text: "",
    "no laser": lambda text: text[: text.index("  lasers:")] + text[text.index("  noise:") :],
    "no direction": lambda text: text.replace("      direction:", "      heading:", 1),
    "a laser through the pinhole": lambda text: text.replace(
        "origin_mm: [", "origin_mm: [0.0, 0.0, 0.0] # [", 1
    ),
    "nan": lambda text: text.replace("offset_mm: ", "offset_mm: .nan # ", 1),
    "another lens": lambda text: text.replace('"plumb_bob"', '"rational_polynomial"'),
    "a later format": lambda text: text.replace("format: 1", "format: 2", 1),
    "cut": lambda text: text[: text.index("camera_matrix:") + 40],
    "a long key": lambda text: "k" * 300 + ": 1\n" + text,
    "refused": lambda text: text.replace('    verdict: "accepted"', '    verdict: "refused"', 1),
    "no line end": lambda text: text.replace("\n", " "),
}
"""Name and damage of a calibration file."""


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_calibration_is_refused(damage: str, program: Path, tmp_path: Path) -> None:
    path = tmp_path / "calibration.yaml"
    path.write_text(DAMAGES[damage](CALIBRATION.read_text()))

    ended = run(program, path, given="L1 100 100\n")

    assert (ended.returncode, ended.stdout) == (2, "")
    assert ended.stderr.startswith(f"error: {path}: ")


def test_a_refused_calibration_that_was_accepted_with_a_reason_is_used(program: Path, tmp_path: Path) -> None:
    text = DAMAGES["refused"](CALIBRATION.read_text())
    path = tmp_path / "calibration.yaml"
    path.write_text(text.replace('accepted_because: ""', 'accepted_because: "a trial"', 1))

    ended = run(program, path, given="L1 100 30\n")

    assert (ended.returncode, ended.stderr) == (0, "")


FRAMES = {
    "empty": b"",
    "text": b"P2\n2 2\n255\n1 2 3 4\n",
    "cut": b"P5\n640 480\n255\nabc",
    "16 bits": b"P5\n2 2\n65535\n" + bytes(8),
    "enormous": b"P5\n99999999 99999999\n255\n",
    "another size": b"P5\n2 2\n255\n" + bytes(4),
}


@pytest.mark.parametrize("damage", FRAMES)
def test_a_damaged_frame_is_refused(damage: str, program: Path, tmp_path: Path) -> None:
    path = tmp_path / "on.pgm"
    path.write_bytes(FRAMES[damage])

    ended = run(program, CALIBRATION, path, path)

    assert (ended.returncode, ended.stdout) == (2, "")


def test_dark_frames_have_no_range(program: Path, tmp_path: Path) -> None:
    calibration = load_calibration(CALIBRATION)
    dark = np.full((calibration.image_height, calibration.image_width), 20, np.uint8)
    path = write_pgm(tmp_path / "dark.pgm", dark)

    ended = run(program, CALIBRATION, path, path)

    assert ended.returncode == 1
    assert ended.stdout.count("no spot") == len(calibration.laser_ranger.lasers)


@pytest.mark.parametrize("line", ["L9 1 2", "L1 1", "L1 1 2 3", "L1 1 2 0 0.1", "L1 a b", "x" * 400])
def test_a_line_that_is_no_spot_is_refused(line: str, program: Path) -> None:
    ended = run(program, CALIBRATION, given=line + "\n")

    assert ended.returncode == 2
    assert "line 1" in ended.stderr
    assert ("L9" in ended.stderr) == line.startswith("L9")
