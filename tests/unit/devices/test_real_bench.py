"""The rig of real parts, opened by its name: firmware behind a serial line, a camera behind a socket."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.firmware.parts import Running, build, hurried
from tests.support.mjpeg import Picture, Stream
from workbench.devices.registry import open_bench
from workbench.model.errors import BadInputError, LaserOffNotConfirmedError, RigNotReadyError
from workbench.model.rig import load_rig
from workbench.spots import find_spots

SCRIPT = Path(sys.executable).with_name("workbench")
RIG = """\
format: 1
rig: real
driver: opencv+serial
laser_class: 2
{devices}
camera:
  width_px: 320
  height_px: 240
  f_px: {{value: 270.0, sd: 10.0}}
  cx_px: {{value: 159.5, sd: 20.0}}
  cy_px: {{value: 119.5, sd: 20.0}}
lasers:
  - {{id: L1, axis: u, x_mm: {{value: -60.0, sd: 0.2}}, y_mm: {{value: 0.0, sd: 0.2}}}}
  - {{id: L2, axis: u, x_mm: {{value: 60.0, sd: 0.2}}, y_mm: {{value: 0.0, sd: 0.2}}}}
"""
DEVICES = """\
devices:
  camera: {{source: "{url}", latency_frames: 2}}
  lasers: {{port: {port}}}
"""
SPOTS_PX = ((100.0, 119.5), (220.0, 119.5))


class Scene:
    """Shows the spots of the lines that the controller drives at this moment."""

    def __init__(self, controller: Running) -> None:
        self._controller = controller

    def picture(self) -> Picture:
        v, u = np.mgrid[0:240, 0:320]
        lines = self._controller.lines()
        shown = np.full((240, 320), 12.0)
        for line, (spot_u, spot_v) in enumerate(SPOTS_PX):
            if lines >> line & 1:
                shown += 180 * np.exp(-((u - spot_u) ** 2 + (v - spot_v) ** 2) / (2 * 1.5**2))
        return shown.astype(np.uint8)


@pytest.fixture(autouse=True)
def _in_time() -> Iterator[None]:
    """Half a second without a turn, as on an overloaded computer, is a hang: here it would be no finding."""
    with hurried():
        yield


@pytest.fixture
def controller(tmp_path: Path) -> Iterator[Running]:
    build("host", tmp_path)
    running = Running("host", tmp_path, tmp_path / "pins.log")
    yield running
    running.stop()


@pytest.fixture
def stream(controller: Running) -> Iterator[Stream]:
    stream = Stream(Scene(controller).picture)
    yield stream
    stream.close()


def write_rig(folder: Path, port: str, url: str = "none.avi") -> Path:
    path = folder / "rig.yaml"
    path.write_text(RIG.format(devices=DEVICES.format(url=url, port=port)))
    return path


def call(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [str(SCRIPT), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def test_the_bench_sees_what_it_lights(tmp_path: Path, controller: Running, stream: Stream) -> None:
    rig = load_rig(write_rig(tmp_path, controller.port, stream.url))
    with open_bench(rig, tmp_path / "session") as bench:
        for (spot_u, spot_v), name in zip(SPOTS_PX, rig.laser_ids, strict=True):
            dark = bench.camera.grab().image
            with bench.lasers.lit([name], for_s=2.0):
                lit = bench.camera.grab().image
            [spot] = find_spots(lit, dark).spots
            assert (spot.u_px, spot.v_px) == pytest.approx((spot_u, spot_v), abs=0.1)
            assert not find_spots(bench.camera.grab().image, dark).spots
    assert controller.lines() == 0


def test_a_camera_unplugged_while_lit(tmp_path: Path, controller: Running, stream: Stream) -> None:
    """Its silence is waited out with the laser's lease renewed: the error names the camera, not a hang."""
    rig = load_rig(write_rig(tmp_path, controller.port, stream.url))
    bench = open_bench(rig, tmp_path / "session")
    stream.goes_on.clear()
    with pytest.raises(RigNotReadyError, match=r"camera .*expected a frame"), bench.lasers.lit(["L1"], 2.0):
        [bench.camera.grab() for _ in range(40)]  # more than have piled up
    assert controller.lines() == 0
    bench.close()


def test_a_bench_without_its_camera_leaves_the_lasers_off_and_free(
    tmp_path: Path, controller: Running
) -> None:
    rig = load_rig(write_rig(tmp_path, controller.port))
    for _ in range(2):  # the second time the port has been let go
        with pytest.raises(RigNotReadyError, match=r"camera none\.avi"):
            open_bench(rig, tmp_path / "session")
    assert controller.lines() == 0


def test_a_rig_that_does_not_say_where_its_devices_are(tmp_path: Path) -> None:
    path = tmp_path / "rig.yaml"
    path.write_text(RIG.format(devices=""))
    with pytest.raises(BadInputError, match=r"devices\.camera\.source: .*\n.*devices\.lasers\.port: "):
        open_bench(load_rig(path), tmp_path / "session")


@pytest.mark.parametrize("wrong", ["5", "3r", "true"])
def test_a_laser_class_that_is_none(tmp_path: Path, wrong: str) -> None:
    path = tmp_path / "rig.yaml"
    path.write_text(RIG.format(devices="").replace("laser_class: 2", f"laser_class: {wrong}"))
    with pytest.raises(BadInputError, match="laser_class"):
        load_rig(path)


def test_lasers_off_is_confirmed(tmp_path: Path, controller: Running) -> None:
    with Path(controller.port).open("wb", buffering=0) as line:
        line.write(b"MASK 3 60000\n")  # what a program of somebody else left lit
        controller.wait_for(3)
    done = call("lasers", "off", "--rig", write_rig(tmp_path, controller.port))
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("all lasers are off, confirmed by laser-range-workbench,")
    assert controller.lines() == 0


def test_lasers_off_that_nobody_confirms(tmp_path: Path) -> None:
    ours, theirs = os.openpty()
    done = call("lasers", "off", "--rig", write_rig(tmp_path, os.ttyname(theirs)))
    os.close(ours)
    os.close(theirs)
    assert done.returncode == LaserOffNotConfirmedError.exit_code == 7
    assert "the lasers may be on" in done.stderr
    assert "Traceback" not in done.stderr


def test_lasers_of_a_rig_without_a_controller() -> None:
    rigs = Path(__file__).parents[3] / "rigs"
    done = call("lasers", "off", "--rig", rigs / "webcam-laser.yaml")
    assert done.returncode == 2
    for what in ("off", "state"):
        done = call("lasers", what, "--rig", rigs / "thesis-emulated.yaml")
        assert done.returncode == 0
        assert "virtual bench" in done.stdout + done.stderr


def test_lasers_state_tells_the_interlock(tmp_path: Path, controller: Running) -> None:
    rig = write_rig(tmp_path, controller.port)
    assert "interlock:  closed" in call("lasers", "state", "--rig", rig).stdout
    controller.toggle_interlock()
    assert "interlock:  open" in call("lasers", "state", "--rig", rig).stdout
