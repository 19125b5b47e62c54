"""The workbench's end of the guardian, with drivers that the guardian cannot open."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.foreign_drivers import install_drivers
from workbench.devices.drivers import load_driver
from workbench.devices.guardian_client import GuardianClient
from workbench.model.errors import LaserOffNotConfirmedError, RigNotReadyError


def client(folder: Path, monkeypatch: pytest.MonkeyPatch) -> GuardianClient:
    install_drivers(folder / "lib", monkeypatch)
    line_type = load_driver("workbench.lasers", "lab_lasers")
    settings = line_type.settings_type(log=str(folder / "lines.log"))
    return GuardianClient(line_type, settings, lasers=2, boot_s=0.0, hang_s=0.5)


def test_commands_are_answered_by_their_number(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    guardian = client(tmp_path, monkeypatch)
    assert guardian.identity == "lab lasers"
    guardian.ask("LIT 3 1000")
    assert guardian.ask("STATE") == [3, True]
    assert guardian.ask("OFF") is None
    assert guardian.ask("STATE") == [0, True]
    guardian.close()
    guardian.close()
    with pytest.raises(ValueError, match="closed"):
        guardian.send("BEAT")


def test_a_guardian_that_cannot_import_its_driver_has_lit_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "workbench.devices.guardian_client.line_reference", lambda line: "no_such_module:Line"
    )
    with pytest.raises(RigNotReadyError, match="no_such_module"):
        client(tmp_path, monkeypatch)


def test_a_guardian_that_is_gone_confirms_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    guardian = client(tmp_path, monkeypatch)
    guardian._process.kill()
    with pytest.raises(LaserOffNotConfirmedError):
        guardian.ask("OFF")
    with pytest.raises(LaserOffNotConfirmedError):
        guardian.close()
