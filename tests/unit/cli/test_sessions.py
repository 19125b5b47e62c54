"""Sessions listed at 80 columns, and found by name: names to be typed again stay in one piece."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.support.command_line import Run, refused
from workbench.cli import sessions
from workbench.cli.sessions import find_session, list_sessions
from workbench.session.journal import Journal
from workbench.session.state import SessionStatus

LONG_WHY = "laser controller at /dev/ttyACM0: request '!': expected 'OK OFF', got a line failure; check it"


def test_sessions_are_listed_with_whole_names(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    names = ["20261122-214141-calibrate-flat", "20261122-214142-calibrate-flat-of-the-long-rig-2"]
    found = [
        SessionStatus(Path("sessions") / names[0], "finished", ("p",), 440, "done"),
        SessionStatus(Path("sessions") / names[1], "failed", ("p",), 12, LONG_WHY),
    ]
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr(sessions, "session_statuses", lambda folder: found)
    list_sessions(Path("sessions"), as_json=False)
    printed = capsys.readouterr().err.splitlines()
    assert max(map(len, printed[:-1])) <= 80
    assert printed[0].split() == [names[0], "finished", "440", "captures"]
    assert printed[1].split() == [names[1], "failed", "12", "captures"]
    assert " ".join(line.strip() for line in printed[2:-1]) == LONG_WHY
    assert printed[-1] == f"resume: workbench resume sessions/{names[1]}"


def test_a_session_with_a_name_as_long_as_the_line_has_two(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    names = ["20261122-214141-calibrate-flat", "20261122-214142-" + "calibrate-" * 6 + "x"]
    found = [SessionStatus(Path("sessions") / name, "finished", ("p",), 440, "done") for name in names]
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr(sessions, "session_statuses", lambda folder: found)
    list_sessions(Path("sessions"), as_json=False)
    printed = capsys.readouterr().err.splitlines()
    assert max(map(len, printed)) <= 80
    assert [line.split() for line in printed] == [
        [names[0], "finished", "440", "captures"],
        [names[1]],
        ["finished", "440", "captures"],
    ]


def test_a_session_is_found_by_the_folder_that_one_stands_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "s/frames").mkdir(parents=True)
    (tmp_path / "s/session.yaml").write_text("")
    monkeypatch.chdir(tmp_path / "s")
    assert find_session(Path(), Path("sessions")) == tmp_path / "s"
    monkeypatch.chdir("frames")
    assert find_session(Path(".."), Path("sessions")) == tmp_path / "s"


def test_how_a_session_ended_takes_two_lines_at_most(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    why = "the calibration is refused: " + "; ".join(f"laser L{n} was seen at 2 standoffs" for n in range(9))
    found = [SessionStatus(Path("sessions/a"), "failed", ("p",), 12, why)]
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr(sessions, "session_statuses", lambda folder: found)
    list_sessions(Path("sessions"), as_json=False)
    printed = capsys.readouterr().err.splitlines()
    assert len(printed) == 4
    assert printed[2].rstrip().endswith("...")
    list_sessions(Path("sessions"), as_json=True)
    assert json.loads(capsys.readouterr().out)["why"] == why


def test_the_only_session_is_running(workbench: Run, tmp_path: Path) -> None:
    (tmp_path / "s").mkdir()
    (tmp_path / "s/session.yaml").write_text("format: 1\n")
    with Journal(tmp_path / "s"):
        refused(workbench("resume", "--sessions", tmp_path), 2, tmp_path / "s", "is running")


def test_a_folder_of_sessions_or_one_session_is_named_directly(
    workbench: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = Path(__file__).parents[3] / "data"
    for folder, names in (
        (data, ["session-0.1.0", "simulation-0.1.0"]),
        (data / "session-0.1.0", ["session-0.1.0"]),
    ):
        outcome = workbench("sessions", folder, "--json")
        assert outcome.code == 0
        assert [Path(json.loads(line)["session_dir"]).name for line in outcome.out.splitlines()] == names
    monkeypatch.chdir(data / "session-0.1.0")
    (line,) = workbench("sessions", ".", "--json").out.splitlines()
    assert Path(json.loads(line)["session_dir"]) == data / "session-0.1.0"
    refused(workbench("sessions", data / "nowhere"), 2, data / "nowhere")
