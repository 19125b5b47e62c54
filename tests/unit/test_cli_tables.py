"""What is listed at 80 columns: names that are looked up, or typed again, stay in one piece."""

from __future__ import annotations

import io
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from rich.console import Console

from workbench.cli import sessions
from workbench.cli.sessions import list_sessions
from workbench.ranging.ranger import Reading
from workbench.report.tables import reading_table
from workbench.session.state import Standing

LONG_WHY = "laser controller at /dev/ttyACM0: asked '!', expected 'OK OFF', got a dead line; check the cable"


def test_sessions_are_listed_with_whole_names(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    names = ["20261122-214141-calibrate-flat", "20261122-214142-calibrate-flat-of-the-long-rig-2"]
    found = [
        Standing(Path("sessions") / names[0], "finished", ("p",), 440, "done"),
        Standing(Path("sessions") / names[1], "failed", ("p",), 12, LONG_WHY),
    ]
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr(sessions, "standings", lambda folder: found)
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
    found = [Standing(Path("sessions") / name, "finished", ("p",), 440, "done") for name in names]
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr(sessions, "standings", lambda folder: found)
    list_sessions(Path("sessions"), as_json=False)
    told = capsys.readouterr().err.splitlines()
    assert max(map(len, told)) <= 80
    assert [line.split() for line in told] == [
        [names[0], "finished", "440", "captures"],
        [names[1]],
        ["finished", "440", "captures"],
    ]


def reading(scene: str, status: str) -> Reading:
    lasers = [SimpleNamespace(laser_id=f"L{n}", range_mm=1000.0 + n) for n in range(4)]
    shape = SimpleNamespace(kind="incline", angle_rad=-0.0143, angle_sigma_rad=0.0033)
    line = SimpleNamespace(shape=shape)
    told: Any = SimpleNamespace(
        scene=scene, status=status, closest_mm=1002.34, sigma_mm=1.2, lines=[line], lasers=lasers
    )
    return cast("Reading", told)


def test_scenes_are_in_one_piece() -> None:
    scenes = ["calibrate-flat.2/4500mm", "accuracy-flat.1/1000mm/00", "a" * 30]
    stream = io.StringIO()
    table = reading_table(
        [reading(scenes[0], "done"), *(reading(s, "not_enough_points") for s in scenes[1:])]
    )
    Console(file=stream, width=80).print(table)
    shown = stream.getvalue()
    assert all(f"│ {scene}" in shown for scene in scenes)
    assert max(map(len, shown.splitlines())) <= 80
    assert "…" not in shown
    assert "incline" in shown
    assert shown.count("not enough") == 2


def test_a_name_longer_than_a_screen_is_folded() -> None:
    stream = io.StringIO()
    Console(file=stream, width=80).print(reading_table([reading("b" * 200, "done")]))
    assert stream.getvalue().count("b") == 200
    assert max(map(len, stream.getvalue().splitlines())) <= 80
