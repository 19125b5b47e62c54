"""A session's captures as a captures file."""

from __future__ import annotations

import hashlib
from math import nan
from pathlib import Path

import pytest

from workbench.model.captures import load_captures
from workbench.model.event import CaptureTaken, FrameRef
from workbench.session.capture_table import NEEDED, write_capture_table


def taken(key: str, **more: object) -> CaptureTaken:
    placement = key.rsplit("/", 2)[0]
    values: dict[str, object] = {
        "key": key,
        "purpose": "calibration",
        "laser_id": key.split("/")[-2],
        "placement_key": placement,
        "standoff_mm": 0.1 + 0.2,
        "repeat": int(key[-2:]),
        "on": FrameRef(path=f"frames/{key}-on.png", sha256="", time_ns=0),
        "off": FrameRef(path=f"frames/{key}-off.png", sha256="", time_ns=0),
    }
    return CaptureTaken.model_validate(values | more)


def test_the_file_is_read_back_as_it_was_captured(tmp_path: Path) -> None:
    path = tmp_path / "captures.csv"
    captures = [
        taken("p.1/300mm/L1/00", standoff_sd_mm=2.5, exposure=20.1, exposure_unit="us"),
        taken("p.1/300mm/L1/01"),
        taken("p.1/300mm/board/00", off=None),
    ]
    sha256 = write_capture_table(path, captures)
    assert hashlib.sha256(path.read_bytes()).hexdigest() == sha256
    rows = load_captures(path)
    assert [(row.laser_id, row.repeat) for row in rows] == [("L1", 0), ("L1", 1), ("board", 0)]
    assert [row.standoff_mm for row in rows] == [0.1 + 0.2] * 3, "to the last digit"
    assert [row.standoff_sd_mm for row in rows] == pytest.approx([2.5, nan, nan], nan_ok=True)
    assert [row.on for row in rows] == [tmp_path / capture.on.path for capture in captures]
    assert rows[2].off is None
    assert {row.scene for row in rows} == {"p.1/300mm"}


def test_a_trials_scene_is_its_own(tmp_path: Path) -> None:
    path = tmp_path / "trial-captures.csv"
    write_capture_table(path, [taken("p.1/300mm/all/00", purpose="trial", scene="p.1/300mm/00")])
    (row,) = load_captures(path)
    assert row.scene == "p.1/300mm/00"


def test_columns_that_no_capture_states_are_left_out(tmp_path: Path) -> None:
    path = tmp_path / "captures.csv"
    write_capture_table(path, [taken("p.1/300mm/L1/00")])
    assert path.read_text().splitlines()[0] == ",".join([*NEEDED, "time_s"])
    write_capture_table(path, [taken("p.1/300mm/L1/00"), taken("p.1/300mm/L1/01", exposure=3.0)])
    assert path.read_text().splitlines()[0] == ",".join([*NEEDED, "exposure", "time_s"])


def test_times_count_from_the_first_capture_by_the_clock_of_the_bench(tmp_path: Path) -> None:
    path = tmp_path / "captures.csv"
    captures = [
        taken("p.1/300mm/L1/00", clock_ns=20_000_000_000),
        taken("p.1/300mm/L1/01", clock_ns=20_250_000_000),
        taken("p.1/600mm/L1/00", clock_ns=19_000_000_000, part=1),
    ]
    write_capture_table(path, captures)
    rows = load_captures(path)
    assert [row.time_s for row in rows] == [1.0, 1.25, 0.0]
    assert [row.part for row in rows] == ["", "", "1"]


def test_without_a_clock_times_are_those_of_the_lit_frames(tmp_path: Path) -> None:
    """Sessions of earlier versions."""
    path = tmp_path / "captures.csv"
    frames = [FrameRef(path="x", sha256="", time_ns=time_ns) for time_ns in (5_000_000_000, 7_000_000_000)]
    write_capture_table(path, [taken(f"p.1/300mm/L1/0{n}", on=frame) for n, frame in enumerate(frames)])
    assert [row.time_s for row in load_captures(path)] == [0.0, 2.0]
