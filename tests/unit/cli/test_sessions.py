"""What is listed at 80 columns: names that are looked up, or typed again, stay in one piece."""

from __future__ import annotations

import io
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from rich.console import Console

from workbench.cli import sessions
from workbench.cli.sessions import find_session, list_sessions
from workbench.ranging.ranger import Reading
from workbench.report.readings import reading_list
from workbench.session.state import SessionStatus

LONG_WHY = "laser controller at /dev/ttyACM0: asked '!', expected 'OK OFF', got a dead line; check the cable"


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
    told = capsys.readouterr().err.splitlines()
    assert max(map(len, told[:-1])) <= 80
    assert told[0].split() == [names[0], "finished", "440", "captures"]
    assert told[1].split() == [names[1], "failed", "12", "captures"]
    assert " ".join(line.strip() for line in told[2:-1]) == LONG_WHY
    assert told[-1] == f"go on: workbench resume sessions/{names[1]}"


def test_a_session_with_a_name_as_long_as_the_line_has_two(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    names = ["20261122-214141-calibrate-flat", "20261122-214142-" + "calibrate-" * 6 + "x"]
    found = [SessionStatus(Path("sessions") / name, "finished", ("p",), 440, "done") for name in names]
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr(sessions, "session_statuses", lambda folder: found)
    list_sessions(Path("sessions"), as_json=False)
    told = capsys.readouterr().err.splitlines()
    assert max(map(len, told)) <= 80
    assert [line.split() for line in told] == [
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
    told = capsys.readouterr().err.splitlines()
    assert len(told) == 4
    assert told[2].rstrip().endswith("...")
    list_sessions(Path("sessions"), as_json=True)
    assert json.loads(capsys.readouterr().out)["why"] == why


def reading(scene: str, status: str = "done", notes: tuple[str, ...] = ()) -> Reading:
    lasers = [SimpleNamespace(laser_id=f"L{n}", range_mm=1000.0 + n) for n in range(4)]
    shape = SimpleNamespace(kind="incline", angle_rad=-0.0143, angle_sigma_rad=0.0033)
    told: Any = SimpleNamespace(
        scene=scene,
        status=status,
        closest_mm=1002.34,
        sigma_mm=1.2,
        lines=[SimpleNamespace(shape=shape)],
        lasers=lasers,
        notes=notes,
    )
    return cast("Reading", told)


def shown(readings: list[Reading]) -> list[str]:
    stream = io.StringIO()
    Console(file=stream, width=80).print(reading_list(readings), highlight=False)
    lines = [line.rstrip() for line in stream.getvalue().splitlines()]
    assert max(map(len, lines)) <= 80
    return lines


def test_a_scene_takes_one_line_where_that_says_it_all() -> None:
    scenes = [f"accuracy-flat.1/{mm}mm/00" for mm in range(100, 4500, 100)]
    title, header, *lines, counted = shown([reading(scene) for scene in scenes])
    assert title == "Ranges (mm, 1 sigma)"
    assert header.split() == ["scene", "closest", "shape"]
    assert len(lines) == len(scenes) == 44
    for line, scene in zip(lines, scenes, strict=True):
        assert line.split("  ", 1)[0] == scene
        assert line.endswith("1002.3 +- 1.2  incline -0.82 +- 0.19 deg")
    assert counted == "44 scenes: 44 done; each laser's range: --json"


def test_what_is_unusual_is_told_below_its_scene() -> None:
    lines = shown([reading("a"), reading("b", "not_enough_points", ("L4: no spot was seen",)), reading("c")])
    assert [line.split("  ")[0] for line in lines[2:4]] == ["a", "b"]
    assert "not enough points; incline" in lines[3]
    assert lines[4] == "    L0 1000.0 L1 1001.0 L2 1002.0 L3 1003.0"
    assert lines[5] == "    L4: no spot was seen"
    assert lines[6].startswith("c ")
    assert lines[7].startswith("3 scenes: 2 done, 1 not enough points")


def test_a_name_longer_than_a_screen_is_folded() -> None:
    lines = shown([reading("b" * 200), reading("c" * 30)])
    assert "".join(lines).count("b") == 200
    assert any(line.startswith("c" * 30 + "  1002.3 +- 1.2  incline") for line in lines)
