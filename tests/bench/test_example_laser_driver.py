"""The example laser driver, installed as a package: commands and a session, with a camera of another kind."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.bench.test_guided_session import Says
from tests.crash.short import CALLER
from tests.firmware.parts import hurried
from tests.support.driver_package import install_example, put_on_path
from tests.support.foreign_drivers import write_rig
from tests.support.mjpeg import Picture, Stream
from tests.unit.procedure.engine.test_check import PROCEDURE
from workbench.devices.registry import open_bench
from workbench.model import event as ev
from workbench.model.prompt import Answer
from workbench.model.rig import load_rig
from workbench.procedure.doctor import examine
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.run import run
from workbench.session.journal import read_journal
from workbench.session.state import session_status

SCRIPT = Path(sys.executable).with_name("workbench")
SPOTS_PX = ((100.0, 119.5), (220.0, 119.5))


class Lab:
    """GPIO files, and a camera on the network that sees the lasers that they switch."""

    def __init__(self, folder: Path) -> None:
        self.files = [folder / f"gpio{number}" for number in (17, 18)]
        for file in self.files:
            file.write_text("1")  # left on by another program
        self.stream = Stream(self.picture)
        self.rig = write_rig(
            folder / "rig.yaml",
            [
                f'camera: {{driver: opencv, source: "{self.stream.url}"}}',
                f"lasers: {{driver: gpio_files, files: {json.dumps(list(map(str, self.files)))}}}",
            ],
        )

    def lit(self) -> list[bool]:
        return [file.read_text().strip() == "1" for file in self.files]

    def picture(self) -> Picture:
        v, u = np.mgrid[0:240, 0:320]
        shown = 12.0 + u % 3  # no camera is as even as one number
        for lit, (spot_u, spot_v) in zip(self.lit(), SPOTS_PX, strict=True):
            shown += lit * 180 * np.exp(-((u - spot_u) ** 2 + (v - spot_v) ** 2) / (2 * 1.5**2))
        return np.asarray(shown, np.uint8)


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    install_example(folder)
    return folder


@pytest.fixture
def lab(installed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Lab]:
    put_on_path(installed, monkeypatch)
    with hurried():  # half a second without a turn is a hang, and here it would be no finding
        lab = Lab(tmp_path)
        yield lab
        lab.stream.close()


def wait_until_off(lab: Lab) -> None:
    """For the guardian, which goes on trying where no lease of the hardware ends an emission."""
    deadline = time.monotonic() + 10
    while any(lab.lit()):
        assert time.monotonic() < deadline
        time.sleep(0.01)


def call(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [str(SCRIPT), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def test_check_finds_its_mistakes(lab: Lab) -> None:
    assert call("check", lab.rig).returncode == 0
    lab.rig.write_text(lab.rig.read_text().replace("gpio_files,", "gpio_files, active_low: maybe,"))
    done = call("check", lab.rig)
    assert done.returncode == 2
    assert f"{lab.rig}:5: devices.lasers.active_low: " in done.stderr


def test_lasers_off_and_state(lab: Lab) -> None:
    assert lab.lit() == [True, True]
    done = call("lasers", "off", "--rig", lab.rig)
    assert done.returncode == 0, done.stderr
    assert lab.lit() == [False, False]
    done = call("lasers", "state", "--rig", lab.rig)
    assert done.returncode == 0, done.stderr
    assert "2 GPIO lines" in done.stdout


@pytest.mark.parametrize("command", [("lasers", "off", "--rig"), ("doctor", "--no-input")])
def test_fewer_files_than_lasers(lab: Lab, command: tuple[str, ...]) -> None:
    lab.rig.write_text(lab.rig.read_text().replace(f', "{lab.files[1]}"', ""))
    assert call(*command, lab.rig).returncode == 2


def test_a_missing_line_is_exit_7_and_the_others_are_off(lab: Lab) -> None:
    lab.files[0].unlink()
    assert call("lasers", "off", "--rig", lab.rig).returncode == 7
    assert lab.files[1].read_text().strip() == "0"
    assert not lab.files[0].exists()
    lab.files[0].write_text("0")


def test_off_that_the_files_do_not_confirm_is_exit_7(lab: Lab) -> None:
    lab.files[1].unlink()
    lab.files[1].symlink_to("/dev/null")  # takes what is written, and reads as nothing
    assert call("lasers", "off", "--rig", lab.rig).returncode == 7
    lab.files[1].unlink()
    lab.files[1].write_text("1")
    wait_until_off(lab)


def test_doctor_sees_each_laser(lab: Lab, tmp_path: Path) -> None:
    rig = load_rig(lab.rig)
    with open_bench(rig, tmp_path / "s") as bench:
        results = list(examine(rig, bench, Says(("laser_class", Answer(value="2")))))
    assert [result for result in results if not result.ok] == []
    assert {"laser L1", "laser L2"} <= {result.part for result in results}
    assert lab.lit() == [False, False]


def test_a_session_captures_through_it(lab: Lab, tmp_path: Path) -> None:
    (tmp_path / "p.yaml").write_text(PROCEDURE)
    plan = Plan.load(lab.rig, [tmp_path / "p.yaml"])
    run(plan, tmp_path / "session", [], CALLER, lambda: None, Says())
    assert session_status(tmp_path / "session").state == "finished"
    spots = [r.event for r in read_journal(tmp_path / "session") if isinstance(r.event, ev.SpotsFound)]
    assert [len(event.spots) for event in spots] == [1] * 8
    assert {round(event.spots[0].u_px) for event in spots} == {100, 220}
    assert lab.lit() == [False, False]
