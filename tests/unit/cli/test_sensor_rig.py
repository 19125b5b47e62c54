"""Rig files from answers."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.command_line import Run
from tests.support.sensor_answers import GIVEN
from workbench.cli.sensor_rig import SPOILT_KEY, SPOILT_MM, Sensor, paths, practice_text, rig_text
from workbench.emulator.spec import emulator_spec
from workbench.model.rig import Rig, load_rig
from workbench.model.yamlfile import parse_yaml_model

ROOT = Path(__file__).parents[3]


def rigs(**answers: str) -> tuple[Rig, Rig]:
    sensor = Sensor.of(GIVEN | answers)
    return (
        parse_yaml_model(rig_text(sensor), Path("real"), Rig),
        parse_yaml_model(practice_text(sensor, 7), Path("practice"), Rig),
    )


def test_both_files_describe_the_sensor_of_the_answers() -> None:
    for rig in rigs(baselines="-60 40v", laser_class="3R"):
        camera = rig.camera
        assert (camera.width_px, camera.height_px, rig.laser_class) == (1280, 720, "3R")
        assert (camera.cx_px.value, camera.cy_px.value) == (639.5, 359.5)
        first, second = rig.lasers
        assert (first.axis, first.x_mm.value, first.x_mm.sd) == ("u", -60.0, 0.2)
        assert (second.axis, second.y_mm.value, second.x_mm.value) == ("v", 40.0, 0.0)
        # As docs/rig-format.md computes it: 0.67 x 0.65 um x 2 / (pi x 3 um).
        assert rig.noise.speckle_sd_px == pytest.approx(0.0924, abs=5e-4)


@pytest.mark.parametrize(
    ("lens", "relative"), [("4 mm", 0.05), ("52 deg", 0.1), ("70 deg diagonal", 0.1), ("1300 px", 0.02)]
)
def test_the_focal_length_is_as_uncertain_as_its_source(lens: str, relative: float) -> None:
    f_px = rigs(lens=lens)[0].camera.f_px
    assert f_px.sd / f_px.value == pytest.approx(relative, rel=0.05)


def test_names_that_yaml_would_read_as_numbers_stay_names() -> None:
    assert [rig.rig for rig in rigs(name="007")] == ["007", "007-practice"]


@pytest.mark.parametrize("serial", ["7", "SN 17/ä", 'LS 12/"34"', "007", "20261130-150255"])
def test_the_serial_number_is_that_of_the_answers(serial: str) -> None:
    assert [rig.serial for rig in rigs(serial=serial)] == [serial, f"{serial}-practice"]


def test_devices_are_those_of_the_answers() -> None:
    real, practice = rigs(camera="rtsp://camera/1", port="/dev/serial/by-id/uno")
    assert real.devices is not None
    assert real.devices.camera.model_dump()["source"] == "rtsp://camera/1"
    assert real.devices.lasers.model_dump()["port"] == "/dev/serial/by-id/uno"
    assert (practice.devices, practice.driver) == (None, "emulated")


def test_the_virtual_bench_has_the_optics_of_the_answers_and_leaves_prompts_to_a_person() -> None:
    spec = emulator_spec(rigs(wavelength="520", f_number="4")[1])
    assert (spec.seed, spec.answers) == (7, False)
    assert (spec.beam.wavelength_nm, spec.lens.f_number, spec.sensor.pitch_um) == (520, 4, 3)


def test_the_comment_spoils_a_placement_of_the_procedure() -> None:
    text = practice_text(Sensor.of(GIVEN), 7)
    spoilt = parse_yaml_model(text.replace("# truth:", "truth:"), Path("practice"), Rig)
    assert emulator_spec(spoilt).truth.placements[SPOILT_KEY].error_mm == SPOILT_MM


def test_both_files_pass_check(workbench: Run, tmp_path: Path) -> None:
    sensor = Sensor.of(GIVEN)
    (tmp_path / "rigs").mkdir()
    files = paths(sensor, tmp_path)
    for path, text in zip(files, (rig_text(sensor), practice_text(sensor, 1)), strict=True):
        path.write_text(text)
    assert workbench("check", *files).code == 0


def test_the_documented_example_is_the_sensor_of_its_answers() -> None:
    """`rigs/uno-webcam.yaml` and docs/build-a-sensor.md describe the sensor of these answers."""
    example, real = load_rig(ROOT / "rigs/uno-webcam.yaml"), rigs()[0]
    for part in ("camera", "lasers", "bench", "noise", "laser_class", "driver"):
        assert getattr(example, part) == getattr(real, part), part
    page = (ROOT / "docs/build-a-sensor.md").read_text()
    for key in ("size", "lens", "wavelength", "baselines", "measured", "laser_class", "port"):
        assert f"| `{GIVEN[key]}` |" in page, key


def test_a_serial_number_is_readable_in_the_file() -> None:
    assert "SN 17/ä" in rig_text(Sensor.of(GIVEN | {"serial": "SN 17/ä"}))


@pytest.mark.parametrize(
    ("measured", "comment"), [("1", "1 mm (1 sigma)"), ("0,5mm", "0.5 mm"), ("ruler", "ruler")]
)
def test_the_comment_of_a_baseline_has_the_unit(measured: str, comment: str) -> None:
    assert f"measured: {comment}" in rig_text(Sensor.of(GIVEN | {"measured": measured}))
