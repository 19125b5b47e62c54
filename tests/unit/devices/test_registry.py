"""From a rig file to its devices: any camera with any lasers and any target, and mistakes with their line."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from tests.support.foreign_drivers import install_drivers, write_rig
from workbench.devices.placed_by_hand import PlacedByHand
from workbench.devices.registry import (
    bench_problems,
    check_driver,
    load_bench_rig,
    open_bench,
    open_lasers,
    whole_bench,
)
from workbench.model.errors import BadInputError
from workbench.model.rig import load_rig
from workbench.model.target import Placement
from workbench.procedure.engine.check import FileCheck, check_file

SCRIPT = Path(sys.executable).with_name("workbench")
RIGS = Path(__file__).parents[3] / "rigs"
OPENCV = "camera: {source: none.avi}"
SERIAL = "lasers: {port: /dev/not-there}"


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder where drivers of another package are installed."""
    install_drivers(tmp_path / "lib", monkeypatch)
    return tmp_path


def block(lab: Path, kind: str, driver: str) -> str:
    return f"{kind}: {{driver: {driver}, log: {lab / 'lines.log'}}}"


def places(path: Path) -> list[str]:
    """Location of each problem: the keys that lead to it."""
    data = yaml.safe_load(path.read_text())
    return [".".join(map(str, one.location)) for one in bench_problems(data, None)]


def call(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [str(SCRIPT), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


@pytest.mark.parametrize("driver", ["opencv+serial", None])
def test_devices_without_drivers_have_the_default_ones(tmp_path: Path, driver: str | None) -> None:
    path = write_rig(tmp_path / "rig.yaml", [OPENCV, SERIAL], driver)
    assert places(path) == []
    check_driver(load_bench_rig(path))
    assert check_file(path) == FileCheck((), ())
    named = [
        "camera: {driver: opencv, source: 0}",
        "lasers: {driver: serial, port: p}",
        "target: {driver: by_hand}",
    ]
    assert places(write_rig(path, named, driver)) == []


def test_any_camera_with_any_lasers_and_any_target(lab: Path) -> None:
    devices = [block(lab, "camera", "lab_camera"), block(lab, "lasers", "lab_lasers")]
    rail = "target: {driver: lab_rail, steps_per_mm: 10}"
    rig = load_bench_rig(write_rig(lab / "rig.yaml", [*devices, rail]))
    with open_bench(rig, lab / "session") as bench:
        assert not bench.virtual
        with bench.lasers.lit(["L2"], for_s=5.0):
            lit = bench.camera.grab().image
        dark = bench.camera.grab().image
        assert (lit != dark).sum() == 1
        assert bench.target.place(Placement(key="k", standoff_mm=300.0)).standoff_mm == 300.25
    with open_bench(load_bench_rig(write_rig(lab / "rig.yaml", devices)), lab / "session") as bench:
        assert isinstance(bench.target, PlacedByHand)


def test_lasers_are_let_go_when_the_camera_does_not_open(lab: Path) -> None:
    rig = load_bench_rig(write_rig(lab / "rig.yaml", [OPENCV, block(lab, "lasers", "lab_lasers")]))
    with pytest.raises(Exception, match=r"none\.avi"):
        open_bench(rig, lab / "session")
    assert (lab / "lines.log").read_text().split()[-1] == "0"
    open_lasers(rig).close()


def test_an_unknown_driver_names_the_installed_ones(lab: Path) -> None:
    path = write_rig(lab / "rig.yaml", [OPENCV, "lasers: {driver: laserbeam9000}"])
    assert places(path) == ["devices.lasers.driver"]
    for command in (["check", path], ["doctor", path, "--no-input"], ["lasers", "off", "--rig", path]):
        done = call(*command)
        assert done.returncode == 2, done.stderr
        assert all(name in done.stderr for name in ("laserbeam9000", "lab_lasers", "nidaqmx", "serial"))
    robot = write_rig(lab / "rig.yaml", [OPENCV, SERIAL], "robot")
    assert places(robot) == ["driver"]
    with pytest.raises(BadInputError, match=r"emulated, opencv\+serial"):
        check_driver(load_rig(robot))


@pytest.mark.long_cases
@pytest.mark.parametrize("driver", ["lab_broken", "lab_unloadable"])
def test_a_driver_that_cannot_be_imported_is_bad_input(lab: Path, driver: str) -> None:
    path = write_rig(lab / "rig.yaml", [OPENCV, f"lasers: {{driver: {driver}}}"])
    assert places(path) == ["devices.lasers.driver"]
    assert call("check", path).returncode == 2


@pytest.mark.long_cases
@pytest.mark.parametrize(
    ("wrong", "place", "line"),
    [
        ("lasers: {driver: lab_lasers}", "devices.lasers.log", 5),
        ("lasers: {driver: lab_lasers, log: x, colour: red}", "devices.lasers.colour", 5),
        ("lasers: {driver: nidaqmx, port: Dev1/port0, lines: 4}", "devices.lasers.lines", 5),
        ("lasers: {driver: serial, port: p, baud: fast}", "devices.lasers.baud", 5),
        ("target: {driver: lab_rail, steps_per_mm: many}", "devices.target.steps_per_mm", 5),
    ],
)
def test_check_reports_a_mistake_in_a_drivers_block_with_its_line(
    lab: Path, wrong: str, place: str, line: int
) -> None:
    others = [OPENCV, *([SERIAL] if wrong.startswith("target") else [])]
    path = write_rig(lab / "rig.yaml", [*others, wrong])
    line += len(others) - 1
    done = call("check", path)
    assert done.returncode == 2
    assert done.stderr.removeprefix("error: ").startswith(f"{path}:{line}: {place}: "), done.stderr
    with pytest.raises(BadInputError) as caught:
        load_bench_rig(path)
    assert str(caught.value).startswith(f"{path}:{line}: {place}: ")


def test_lasers_off_needs_no_other_device(lab: Path) -> None:
    devices = ["camera: {driver: not_installed, source: 3}", block(lab, "lasers", "lab_lasers")]
    path = write_rig(lab / "rig.yaml", devices)
    for what in ("off", "state"):
        done = call("lasers", what, "--rig", path)
        assert done.returncode == 0, done.stderr
        assert "lab lasers" in done.stdout


@pytest.mark.parametrize("devices", ["[]", "3", "{camera: 3}", "{beamer: {}}", "{camera: {driver: 7}}"])
def test_devices_that_are_no_blocks(tmp_path: Path, devices: str) -> None:
    path = write_rig(tmp_path / "rig.yaml", [], "opencv+serial")
    path.write_text(path.read_text().replace("rig: lab\n", f"rig: lab\ndevices: {devices}\n"))
    mistakes = check_file(path).mistakes
    assert any(mistake.startswith(f"{path}:3: devices") for mistake in mistakes)


def test_a_rig_without_devices_can_be_fitted_but_not_run(tmp_path: Path) -> None:
    path = write_rig(tmp_path / "rig.yaml", [])
    rig = load_bench_rig(path)
    with pytest.raises(BadInputError):
        check_driver(rig)
    with pytest.raises(BadInputError):
        open_lasers(rig)
    assert len(check_file(path).notes) == 1


def test_the_virtual_bench_is_opened_as_a_whole() -> None:
    rig = load_bench_rig(RIGS / "thesis-emulated.yaml")
    whole = whole_bench(rig)
    assert whole is not None
    assert whole.virtual
    assert list(whole.blocks) == ["emulator"]
    assert whole_bench(rig.model_copy(update={"driver": "opencv+serial"})) is None
