"""`workbench lasers off` and `lasers state`; real controllers are in tests/unit/devices."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.command_line import Run, refused

ROOT = Path(__file__).parents[3]
VIRTUAL = ROOT / "rigs/thesis-emulated.yaml"


@pytest.mark.parametrize("command", ["off", "state"])
def test_the_virtual_bench_has_no_lasers_outside_its_command(workbench: Run, command: str) -> None:
    outcome = workbench("lasers", command, "--rig", VIRTUAL)
    assert outcome.code == 0
    assert "thesis-emulated" in outcome.out


@pytest.mark.parametrize(("command", "code"), [("off", 7), ("state", 4)])
def test_a_controller_that_is_not_there_confirms_nothing(
    workbench: Run, tmp_path: Path, command: str, code: int
) -> None:
    rig, port = tmp_path / "rig.yaml", tmp_path / "no-port"
    text = (ROOT / "rigs/webcam-laser.yaml").read_text()
    rig.write_text(text + f"devices:\n  lasers: {{driver: serial, port: {port}}}\n")
    refused(workbench("lasers", command, "--rig", rig), code, port)


def test_a_rig_without_a_controller_is_refused(workbench: Run) -> None:
    refused(workbench("lasers", "off", "--rig", ROOT / "rigs/webcam-laser.yaml"), 2, "webcam-laser")
