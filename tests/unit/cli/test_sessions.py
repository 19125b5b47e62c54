"""Sessions listed at 80 columns, and found by name: names to be typed again stay in one piece."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from tests.support.command_line import Run, refused
from tests.support.reference_session import REFERENCE, copied
from workbench.cli import sessions
from workbench.cli.sessions import find_session, list_sessions
from workbench.session.index import IndexedSession
from workbench.session.journal import Journal
from workbench.session.state import SessionStatus

OLD = Path(__file__).parents[3] / "data/session-0.1.0"
LONG_WHY = "laser controller at /dev/ttyACM0: request '!': expected 'OK OFF', got a line failure; check it"


def listed(
    found: list[SessionStatus], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> list[str]:
    """Lines on standard output at 80 columns."""
    monkeypatch.setenv("COLUMNS", "80")
    indexed = [IndexedSession(one, "s-1", "2026-11-22", "none") for one in found]
    monkeypatch.setattr(sessions, "indexed_sessions", lambda folder: indexed)
    list_sessions(Path("sessions"), as_json=False)
    captured = capsys.readouterr()
    assert captured.err == ""
    return captured.out.splitlines()


def test_sessions_are_listed_with_result_cause_and_command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = Path("sessions")
    names = ["20261122-214141-calibrate-flat", "20261122-214142-" + "calibrate-" * 6 + "x"]
    found = [
        SessionStatus(
            Path("sessions") / names[0], "finished", ("p",), 440, "done", "thesis", "accepted: rms 0.04 px"
        ),
        SessionStatus(folder / names[1], "failed", ("p",), 12, LONG_WHY, "thesis"),
    ]
    printed = listed(found, monkeypatch, capsys)
    assert printed[0].split() == [names[0], "thesis", "440", "captures", "finished"]
    assert printed[1].strip() == "accepted: rms 0.04 px"
    whole = " ".join(" ".join(printed[2:]).split())
    assert whole == f"{names[1]} thesis 12 captures failed {LONG_WHY} workbench resume sessions/{names[1]}"
    assert printed[-1].strip() == f"workbench resume sessions/{names[1]}", "to be copied in one piece"


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
    printed = listed(found, monkeypatch, capsys)
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


def test_sessions_are_selected_by_rig_day_and_verdict(workbench: Run, tmp_path: Path) -> None:
    copied(tmp_path)
    shutil.copytree(OLD, tmp_path / OLD.name, ignore=shutil.ignore_patterns("frames"))
    for options, names in (
        ((), [REFERENCE.name, OLD.name]),
        (("--rig", "reference-1"), [REFERENCE.name]),
        (("--rig", "thesis-emulated"), [OLD.name]),
        (("--since", "2026-11-30"), [REFERENCE.name]),
        (("--verdict", "accepted"), [REFERENCE.name, OLD.name]),
        (("--verdict", "refused"), []),
    ):
        listed = workbench("sessions", tmp_path, "--json", *options)
        assert listed.code == 0
        found = [json.loads(line) for line in listed.out.splitlines()]
        assert [Path(one["session_dir"]).name for one in found] == names
    assert workbench("sessions", tmp_path, "--since", "yesterday").code == 2
    assert workbench("sessions", tmp_path, "--verdict", "good").code == 2
