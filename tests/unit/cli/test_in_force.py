"""Remark on the calibration in force, by `range`, `view` and a session of another calibration."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.support.command_line import Run
from tests.support.reference_session import REFERENCE, SERIAL, copied, edit_calibration, repeated
from workbench.cli.in_force import SESSIONS, note_if_not_in_force, sessions_of
from workbench.cli.view import Request, recording_of
from workbench.model.calibration import load_calibration


def remark(path: Path, folder: Path, capsys: pytest.CaptureFixture[str]) -> list[str]:
    note_if_not_in_force(path, load_calibration(path), folder)
    return capsys.readouterr().err.splitlines()


def test_another_calibration_in_force_is_one_line(
    workbench: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    old = copied(tmp_path, "a") / "calibration.yaml"
    new = repeated(tmp_path, "b", days=1) / "calibration.yaml"
    assert (len(remark(old, tmp_path, capsys)), remark(new, tmp_path, capsys)) == (1, [])
    assert workbench("use", old, "--rig", SERIAL, "--reason", "x", "--sessions", tmp_path).code == 0
    assert (remark(old, tmp_path, capsys), len(remark(new, tmp_path, capsys))) == ([], 1)
    old.write_text(old.read_text() + "# edited\n")
    (line,) = remark(new, tmp_path, capsys)
    assert str(old) in line


def test_without_sessions_there_is_no_remark(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = REFERENCE / "calibration.yaml"
    assert remark(path, tmp_path / "missing", capsys) == []
    assert remark(path, tmp_path, capsys) == []
    assert list(tmp_path.glob("sensors.jsonl")) == []


def test_the_folder_is_that_of_the_session(tmp_path: Path) -> None:
    session = copied(tmp_path)
    assert sessions_of(session) == tmp_path
    assert sessions_of(tmp_path / "x.csv", session / "calibration.yaml") == tmp_path
    assert sessions_of(tmp_path / "x.csv", tmp_path / "calibration.yaml") == SESSIONS


def test_range_of_a_session_has_the_remark(workbench: Run, tmp_path: Path) -> None:
    session = copied(tmp_path, "a", frames=True)
    later = repeated(tmp_path, "b", days=1) / "calibration.yaml"
    old, new = (
        workbench("range", session, "--calibration", path) for path in (session / "calibration.yaml", later)
    )
    assert (old.code, new.code) == (0, 0)
    assert str(later) in old.err
    assert str(later) not in new.err


@pytest.mark.long_cases
@pytest.mark.parametrize("named", ["calibration.yaml", ""])
def test_view_of_an_edited_calibration_has_a_remark(
    tmp_path: Path, named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    session = copied(tmp_path, frames=True)
    (tmp_path / "out").mkdir()
    request = Request((session / named,), tmp_path, None)
    recording_of(request, tmp_path / "out")
    assert "sha256" not in capsys.readouterr().err
    edit_calibration(session)
    recording_of(request, tmp_path / "out")
    assert "sha256" in capsys.readouterr().err


def test_a_calibration_dated_in_the_future_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "c.yaml"
    text = (REFERENCE / "calibration.yaml").read_text()
    path.write_text(re.sub(r'created: "\d{4}', 'created: "2999', text))
    (line,) = remark(path, tmp_path / "missing", capsys)
    assert "2999" in line
