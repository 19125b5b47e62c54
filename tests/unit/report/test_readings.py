"""Ranges listed at 80 columns."""

from __future__ import annotations

import io
from types import SimpleNamespace
from typing import Any, cast

import pytest
from rich.console import Console

from workbench.ranging.ranger import Reading
from workbench.report.readings import _Row, reading_line, reading_list


def reading(scene: str, status: str = "done", notes: tuple[str, ...] = ()) -> Reading:
    lasers = [SimpleNamespace(laser_id=f"L{n}", range_mm=1000.0 + n) for n in range(4)]
    shape = SimpleNamespace(kind="incline", angle_rad=-0.0143, angle_sigma_rad=0.0033)
    told: Any = SimpleNamespace(
        scene=scene,
        status=status,
        closest_mm=1002.34,
        sigma_mm=1.2,
        interval_mm=(1000.0, 1004.7),
        shapes=[SimpleNamespace(shape=shape)],
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


def test_a_line_states_the_kind_of_its_uncertainties() -> None:
    line = reading_line(reading("0"))
    assert "1002.3 +- 1.2 mm" in line
    assert line.index("incline") < line.index("(1 sigma)")


def test_a_usual_reading_takes_one_line() -> None:
    scenes = [f"accuracy-flat.1/{mm}mm/00" for mm in range(100, 4500, 100)]
    title, header, *lines, counted = shown([reading(scene) for scene in scenes])
    assert title == "Ranges (mm, 1 sigma)"
    assert header.split() == ["scene", "closest", "shape"]
    assert len(lines) == len(scenes) == 44
    for line, scene in zip(lines, scenes, strict=True):
        assert line.split("  ", 1)[0] == scene
        assert line.endswith("1002.3 +- 1.2  incline -0.82 +- 0.19 deg")
    assert counted.startswith("44 scenes: 44 done")


def test_details_of_an_unusual_reading_are_below_its_line() -> None:
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


@pytest.mark.parametrize("width", [30, 50, 80])
@pytest.mark.parametrize("scene", ["a", "b" * 20, "\u65e5\u672c", "tab\there"])
def test_a_row_is_written_as_its_table_is(width: int, scene: str) -> None:
    """Where it fits it is written without one."""
    row = _Row((20, 8), scene, "1.2", "incline -0.82 +- 0.19 deg")
    written = []
    for part in (row, row.table):
        stream = io.StringIO()
        Console(file=stream, width=width).print(part, highlight=False)
        written.append(stream.getvalue())
    assert written[0] == written[1]
