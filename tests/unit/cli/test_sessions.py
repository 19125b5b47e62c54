"""Sessions listed at 80 columns, and found by name: names to be typed again stay in one piece."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from tests.support.command_line import Run, refused
from tests.support.fits import fitted
from tests.support.records import placed
from tests.support.reference_session import REFERENCE, copied
from workbench.cli import sessions
from workbench.cli.sessions import find_session, list_sessions
from workbench.model import event as ev
from workbench.model.fit_event import Fault
from workbench.session.index import IndexedSession
from workbench.session.journal import Journal
from workbench.session.manifest import MANIFEST
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


def ended(folder: Path, name: str, code: int, message: str, *events: ev.Event) -> Path:
    """Folder of a session that ended with an exit code."""
    session = folder / name
    session.mkdir()
    shutil.copy(REFERENCE / MANIFEST, session)
    with Journal(session) as journal:
        journal.append(ev.SessionStarted(session=name, rig="r", procedures=("p",)))
        for event in (*events, ev.SessionFinished(exit_code=code, message=message)):
            journal.append(event)
    return session


def test_causes_are_printed_whole_and_those_of_equal_kind_once(workbench: Run, tmp_path: Path) -> None:
    reasons = [f"laser L{n} was seen at 2 standoffs, expected at least 3. Do: add some" for n in range(9)]
    wrong = f"trial: the ranges disagree; {'much ' * 60}do this"
    refusal = f"the calibration is refused: {'; '.join(reasons)}"
    ended(tmp_path, "a", 3, refusal, fitted(*reasons, needs_standoffs=True))
    ended(tmp_path, "b", 3, wrong, placed("p.1/x"), ev.PlacementFinished(key="p.1/x"))
    printed = " ".join(workbench("sessions", tmp_path).out.split())
    assert printed.count("was seen at") == 1
    assert all(f"L{n}" in printed for n in range(9))
    assert "Do:" not in printed, "the command follows"
    assert wrong in printed
    first, second = workbench("sessions", tmp_path, "--json").out.splitlines()
    assert (json.loads(first)["why"], json.loads(second)["why"]) == (refusal, wrong)


def test_a_session_that_a_resumption_would_end_likewise_is_repaired(workbench: Run, tmp_path: Path) -> None:
    complete = (placed("p.1/x"), ev.PlacementFinished(key="p.1/x"))
    swapped = Fault(name="lasers_swapped", message="exchanged. Do: exchange them")
    ended(tmp_path, "a", 3, "trial failed", *complete)
    ended(tmp_path, "b", 3, "capture failed", placed("p.1/x"))
    ended(tmp_path, "c", 4, "camera gone", *complete)
    ended(tmp_path, "d", 3, "refused", *complete, fitted(swapped.message, faults=(swapped,)))
    printed = workbench("sessions", tmp_path).out.splitlines()
    commands = [line.split()[1:3] for line in printed if line.startswith("    workbench ")]
    expected = [("repair", "a"), ("resume", "b"), ("resume", "c")]
    assert commands == [[word, str(tmp_path / name)] for word, name in expected]
    assert "Do: exchange them" in " ".join(printed)


def test_the_only_session_is_running(workbench: Run, tmp_path: Path) -> None:
    (tmp_path / "s").mkdir()
    (tmp_path / "s/session.yaml").write_text("format: 1\n")
    with Journal(tmp_path / "s"):
        refused(workbench("resume", "--sessions", tmp_path), 2, tmp_path / "s", "is running")


def test_beside_a_running_session_those_that_can_go_on_are_named(workbench: Run, tmp_path: Path) -> None:
    others = [ended(tmp_path, name, 5, "stopped") for name in ("a", "b")]
    finished = ended(tmp_path, "c", 0, "done")
    (tmp_path / "s").mkdir()
    (tmp_path / "s/session.yaml").write_text("format: 1\n")
    with Journal(tmp_path / "s"):
        outcome = workbench("resume", "--sessions", tmp_path)
    refused(outcome, 2, tmp_path / "s", *(f"workbench resume {other}" for other in others))
    assert str(finished) not in outcome.err


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


def test_a_session_in_the_future_is_remarked_by_sessions_and_report(workbench: Run, tmp_path: Path) -> None:
    session = copied(tmp_path)
    arguments = (["sessions", tmp_path], ["report", session, "--no-input"])
    assert ["2999" in workbench(*line).err for line in arguments] == [False, False]
    manifest = session / "session.yaml"
    manifest.write_text(manifest.read_text().replace("2026-11-30T08:50:45+0000", "2999-11-30T08:50:45+0000"))
    assert ["2999" in workbench(*line).err for line in arguments] == [True, True]
