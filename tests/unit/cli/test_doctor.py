"""`workbench doctor`; the checks themselves are tested with `procedure.doctor`."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.command_line import Run, refused
from workbench.cli import doctor
from workbench.cli.found_devices import FoundDevice

RIG = (Path(__file__).parents[3] / "rigs/thesis-emulated.yaml").read_text()


@pytest.mark.parametrize(
    ("block", "code", "words"),
    [
        ("controller: {interlock_closed: false}", 4, ("interlock", "laser L1", "laser L4")),
        ("answers: false", 6, ("prompt safety",)),
    ],
)
def test_what_is_not_ready_has_its_exit_code(
    workbench: Run, tmp_path: Path, block: str, code: int, words: tuple[str, ...]
) -> None:
    rig = tmp_path / "rig.yaml"
    assert "seed: 2001" in RIG
    rig.write_text(RIG.replace("seed: 2001", f"seed: 2001\n  {block}"))
    refused(workbench("doctor", rig, "--no-input"), code, *words)


REAL = """\
driver: opencv+serial
devices:
  camera: {source: /dev/video99}
  lasers: {port: /dev/ttyACM99}
"""


def test_all_parts_are_reported_with_the_devices_that_are_connected(
    workbench: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(doctor, "found_cameras", lambda: [FoundDevice("/dev/video3", "Grey camera")])
    monkeypatch.setattr(doctor, "found_ports", list)
    rig = tmp_path / "rig.yaml"
    rig.write_text(RIG.partition("emulator:")[0].replace("driver: emulated\n", REAL))
    outcome = workbench("doctor", rig, "--no-input")
    refused(outcome, 4, "/dev/ttyACM99", "/dev/video99", "/dev/video3 (Grey camera)", "No serial port")
    words = [line[:4] for line in outcome.err.splitlines() if line[:4] in ("FAIL", "----")]
    assert words == ["FAIL", "----", "FAIL", *["----"] * 7]


def test_a_device_that_this_user_may_not_open_has_its_group(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("os.access", lambda *_: False)
    hint = doctor._devices("/dev/null", [], "serial port", "dialout")
    assert hint is not None
    assert "dialout" in hint
    assert doctor._devices("rtsp://camera", [], "camera", "video") is None
