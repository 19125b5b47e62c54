"""Rows of a captures file as scenes, and their readings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.support.rangers import positions
from workbench.model.captures import load_captures
from workbench.model.errors import BadInputError
from workbench.ranging.captures import BLOCK, _blocks, read_captures, scenes
from workbench.ranging.ranger import Ranger


def captures(tmp_path: Path, *rows: str) -> Path:
    path = tmp_path / "c.csv"
    path.write_text("\n".join(["laser_id,standoff_mm,repeat,u_px,v_px,scene", *rows]) + "\n")
    return path


def test_repeats_average_as_the_fit_averages_them(ranger: Ranger, tmp_path: Path) -> None:
    (spot,) = ranger.sensor.spot_px("L1", np.array([800.0])).tolist()
    one = captures(tmp_path, f"L1,,0,{spot[0]},{spot[1]},s")
    (single,) = read_captures(ranger, load_captures(one))
    many = captures(tmp_path, *(f"L1,,{n},{spot[0]},{spot[1]},s" for n in range(25)))
    (mean,) = read_captures(ranger, load_captures(many))
    assert single.sigma_mm is not None
    assert mean.sigma_mm is not None
    assert mean.sigma_mm < single.sigma_mm
    lacking = captures(tmp_path, f"L1,,0,{spot[0]},{spot[1]},s", f"L1,,1,{spot[0]},,s")
    (reading,) = read_captures(ranger, load_captures(lacking))
    assert reading.status == "done"
    assert reading.closest_mm == pytest.approx(800.0, rel=1e-6)


def test_repeats_that_disagree_widen_the_deviation(ranger: Ranger, tmp_path: Path) -> None:
    (spot,) = ranger.sensor.spot_px("L1", np.array([800.0])).tolist()
    path = captures(tmp_path, f"L1,,0,{spot[0] - 1},{spot[1]},s", f"L1,,1,{spot[0] + 1},{spot[1]},s")
    (reading,) = read_captures(ranger, load_captures(path))
    # The mean of two readings 2 px apart is known to about 1 px: r^2 / (f b) of it in range.
    assert reading.sigma_mm == pytest.approx(1.0 * 800.0**2 / (535.0 * 60.0), rel=0.4)


def test_rows_that_share_a_scene_are_one(ranger: Ranger, tmp_path: Path) -> None:
    (one,) = positions(ranger, {"L1": 800.0}).tolist()
    (four,) = positions(ranger, {"L4": 800.0}).tolist()
    path = captures(
        tmp_path,
        f"L1,,0,{one[0] - 0.1},{one[1]},wall",
        f"L1,,1,{one[0] + 0.1},{one[1]},wall",
        f"L4,,0,{four[0]},,wall",
        f"L4,,0,{four[0]},,",
    )
    wall, single = read_captures(ranger, load_captures(path))
    assert (wall.scene, wall.status, single.scene) == ("wall", "done", "row 5")
    assert [laser.range_mm for laser in wall.lasers] == pytest.approx([800.0, 800.0], rel=1e-6)
    assert wall.lasers[1].v_px is None


def test_all_lasers_lit_are_a_scene_by_row(tmp_path: Path) -> None:
    path = tmp_path / "c.csv"
    path.write_text(
        "laser_id,standoff_mm,repeat,on,scene\nall,,0,a.png,s\nall,,1,b.png,s\nL1,,0,c.png,t\nL2,,0,d.png,t\n"
    )
    grouped = scenes(load_captures(path))
    assert {name: [row.row for row in rows] for name, rows in grouped.items()} == {
        "s": [2],
        "s (row 3)": [3],
        "t": [4, 5],
    }


def test_no_row_is_lost_where_lasers_lit_together_and_alone_share_a_scene(tmp_path: Path) -> None:
    path = tmp_path / "c.csv"
    rows = ["all,,0,a.png,s", "L1,,0,b.png,s", "all,,1,c.png,s (row 5)", "all,,2,d.png,s", "L2,,0,e.png,s"]
    rows += ["L3,,0,f.png,t", "all,,0,g.png,t", "L4,,0,h.png,t", "all,,0,i.png,s (row 5)"]
    path.write_text("\n".join(["laser_id,standoff_mm,repeat,on,scene", *rows]) + "\n")
    grouped = scenes(load_captures(path))
    assert {name: [row.row for row in rows] for name, rows in grouped.items()} == {
        "s": [2],
        "s (fired alone)": [3, 6],
        "s (row 5)": [4],
        "s (row 5) (row 5)": [5],
        "t": [7, 9],
        "t (row 8)": [8],
        "s (row 5) (row 10)": [10],
    }


def test_scenes_are_ranged_in_blocks_and_those_with_images_alone(tmp_path: Path) -> None:
    path = tmp_path / "c.csv"
    rows = [f"L1,,0,,100,240,s{n}" for n in range(BLOCK + 2)]
    rows += ["L1,,0,a.png,,,t", "L1,,0,b.png,,,u", "L1,,0,,100,240,v", "L2,,0,,101,240,v"]
    path.write_text("\n".join(["laser_id,standoff_mm,repeat,on,u_px,v_px,scene", *rows]) + "\n")
    grouped = scenes(load_captures(path))
    blocks = [[*block] for block in _blocks(grouped)]
    assert [len(block) for block in blocks] == [BLOCK, 2, 1, 1, 1]
    assert [name for block in blocks for name in block] == [*grouped]


def test_a_laser_that_the_calibration_does_not_have(ranger: Ranger, tmp_path: Path) -> None:
    path = captures(tmp_path, "L9,,0,1,2,s")
    with pytest.raises(BadInputError, match="row 2, column laser_id: expected all or one of"):
        list(read_captures(ranger, load_captures(path)))


def test_rows_of_unknown_lasers_are_named_once_for_each_laser(ranger: Ranger, tmp_path: Path) -> None:
    rows = (f"{laser},,{n},10.0,20.0,{laser}{n}" for n in range(3) for laser in ("L1", "L8", "L9"))
    with pytest.raises(BadInputError) as refused:
        list(read_captures(ranger, load_captures(captures(tmp_path, *rows))))
    assert [line.split(", ")[0] for line in str(refused.value).splitlines()] == [
        "row 3 and 2 further rows",
        "row 4 and 2 further rows",
    ]
