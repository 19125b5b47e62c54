"""Assignment, the ranger's answers, the captures file as scenes, and the control flow of a reading."""

from __future__ import annotations

from itertools import permutations
from pathlib import Path

import numpy as np
import pytest

from tests.unit.rigs import World, thesis_rig
from tests.unit.test_calibration_file import PROVENANCE
from workbench.calibration.export import calibrate
from workbench.calibration.fit import fit
from workbench.model.acceptance import Acceptance
from workbench.model.captures import load_captures
from workbench.model.errors import BadInputError
from workbench.ranging.acquire import acquire
from workbench.ranging.assignment import assign
from workbench.ranging.captures import read_captures, scenes
from workbench.ranging.ranger import Ranger
from workbench.spots import Finding, Spot

IDS = ("L1", "L2", "L3", "L4")


@pytest.fixture(scope="module")
def ranger() -> Ranger:
    rig = thesis_rig()
    return Ranger(calibrate(fit(rig, World(rig, 1).sightings()), Acceptance(), PROVENANCE)[0])


def positions(ranger: Ranger, ranges_mm: dict[str, float]) -> np.ndarray:
    return np.concatenate([ranger.sensor.spot_px(i, np.array([r])) for i, r in ranges_mm.items()])


def spots(ranger: Ranger, ranges_mm: dict[str, float]) -> list[Spot]:
    return [Spot(u, v, 0.03, 0.03, 1e4, 1.5, 150.0) for u, v in positions(ranger, ranges_mm).tolist()]


@pytest.mark.parametrize("range_mm", [150.0, 600.0, 2500.0, 4000.0])
def test_spots_of_a_flat_are_dealt_in_any_order(ranger: Ranger, range_mm: float) -> None:
    pixels = positions(ranger, dict.fromkeys(IDS, range_mm))
    for order in permutations(range(4)):
        expected = tuple(IDS[i] for i in order)
        assert assign(ranger.sensor, pixels[list(order)], np.full((4, 2), 0.05)) == expected


@pytest.mark.parametrize("angle_deg", [-45.0, 30.0, 60.0])
def test_spots_of_an_incline_are_dealt(ranger: Ranger, angle_deg: float) -> None:
    slope = np.tan(np.radians(angle_deg))
    tilted = {i: 500.0 + slope * x for i, x in zip(IDS, (-60, -30, 30, 60), strict=True)}
    assert assign(ranger.sensor, positions(ranger, tilted), np.full((4, 2), 0.05)) == IDS


def test_spots_that_fit_two_ways_are_not_dealt(ranger: Ranger) -> None:
    """Two spots in one place can be swapped at will."""
    pixels = positions(ranger, {"L1": 500.0, "L2": 500.0, "L3": 500.0, "L4": 500.0})
    pixels[1] = pixels[0]
    assert assign(ranger.sensor, pixels, np.full((4, 2), 0.05)) is None


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_steps_in_depth_are_dealt_rightly_or_not_at_all(seed: int) -> None:
    """A post before a wall, and one laser of a flat on another surface: where a swap could deceive."""
    world = World(thesis_rig(), seed)
    ranger = Ranger(calibrate(fit(world.rig, world.sightings()), Acceptance(), PROVENANCE)[0])
    rng = np.random.default_rng(seed)
    right = wrong = 0
    for _ in range(150):
        depths = np.full(4, rng.uniform(300.0, 3000.0))
        depths[rng.integers(4)] *= rng.uniform(0.5, 2.0)
        at = zip(IDS, depths + world.values["offset_mm"], strict=True)
        pixels = np.array([world.pixel(i, z) for i, z in at]) + rng.normal(0.0, 0.05, (4, 2))
        dealt = assign(ranger.sensor, pixels, np.full((4, 2), 0.03))
        right += dealt == IDS
        wrong += dealt not in (None, IDS)
    assert wrong == 0
    assert right > 75


def test_fewer_spots_than_lasers_are_not_dealt(ranger: Ranger) -> None:
    assert assign(ranger.sensor, positions(ranger, {"L1": 500.0}), np.full((1, 2), 0.05)) is None


def test_a_flat(ranger: Ranger) -> None:
    reading = ranger.read_lit("s", spots(ranger, dict.fromkeys(IDS, 800.0)))
    assert reading.status == "done"
    assert [laser.laser_id for laser in reading.lasers] == list(IDS)
    assert reading.closest_mm == pytest.approx(800.0)
    assert reading.flat_mm == pytest.approx(800.0)
    assert reading.flat_sigma_mm is not None
    assert reading.sigma_mm is not None
    assert 0 < reading.flat_sigma_mm < reading.sigma_mm


def test_the_closest_is_the_nearest_laser_s(ranger: Ranger) -> None:
    reading = ranger.read_lit("s", spots(ranger, {"L1": 520.0, "L2": 510.0, "L3": 490.0, "L4": 480.0}))
    assert reading.closest_mm == pytest.approx(480.0)


@pytest.mark.parametrize("count", [0, 1, 3, 5])
def test_not_as_many_spots_as_lasers(ranger: Ranger, count: int) -> None:
    seen = (spots(ranger, dict.fromkeys(IDS, 800.0)) * 2)[:count]
    reading = ranger.read_lit("s", seen)
    assert reading.status == ("not_enough_points" if count else "no_points")
    assert reading.closest_mm is None
    assert reading.lasers == ()
    assert len(reading.notes) == 1


def test_lasers_fired_alone_with_one_missing(ranger: Ranger) -> None:
    pixels = positions(ranger, {"L1": 800.0, "L4": 805.0})
    reading = ranger.read_known("s", 3, ["L1", "L4"], pixels, np.full((2, 2), np.nan))
    assert reading.status == "not_enough_points"
    assert reading.closest_mm == pytest.approx(800.0)


def test_a_laser_whose_spot_lies_beyond_infinity_does_not_count(ranger: Ranger) -> None:
    pixels = positions(ranger, {"L1": 800.0, "L4": np.inf}) - [[0.0, 0.0], [3.0, 0.0]]
    reading = ranger.read_known("s", 2, ["L1", "L4"], pixels, np.full((2, 2), 0.05))
    assert [laser.laser_id for laser in reading.lasers] == ["L1"]
    assert reading.status == "not_enough_points"
    assert reading.flat_mm == pytest.approx(800.0)


@pytest.mark.parametrize(
    ("u_px", "v_px", "why"),
    [
        (300.0, -5.0, "outside the picture"),
        (300.0, 481.0, "outside the picture"),
        (645.0, 240.0, "outside the picture"),
        (300.0, 300.0, "off the laser's line"),
    ],
)
def test_a_spot_that_cannot_be_the_laser_s_has_no_range(
    ranger: Ranger, u_px: float, v_px: float, why: str
) -> None:
    reading = ranger.read_known("s", 1, ["L1"], np.array([[u_px, v_px]]), np.full((1, 2), 0.05))
    assert (reading.status, reading.closest_mm, reading.lasers) == ("no_points", None, ())
    assert reading.notes[0].startswith("L1: ")
    assert why in reading.notes[0]


def test_a_spot_all_but_at_infinity_has_no_range(ranger: Ranger) -> None:
    spot = ranger.sensor.spot_px("L4", np.array([3e6]))
    reading = ranger.read_known("s", 1, ["L4"], spot, np.full((1, 2), 0.05))
    assert reading.status == "no_points"
    assert "mm only" in reading.notes[0] or "infinity" in reading.notes[0]


def test_a_range_beyond_the_calibrated_ones_is_marked(ranger: Ranger) -> None:
    reading = ranger.read_lit("s", spots(ranger, dict.fromkeys(IDS, 4600.0)))
    assert reading.status == "done"
    assert reading.notes[0] == "L1: 4600 mm lies outside the calibrated 125 to 4500 mm"
    assert ranger.read_lit("s", spots(ranger, dict.fromkeys(IDS, 4400.0))).notes == ()


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


def test_normal_capture_is_enough_where_every_spot_shows(ranger: Ranger) -> None:
    fired: list[tuple[str, ...]] = []

    def shoot(ids: tuple[str, ...]) -> Finding:
        fired.append(ids)
        return Finding(tuple(spots(ranger, dict.fromkeys(ids, 700.0))))

    assert acquire(ranger, "s", shoot).status == "done"
    assert fired == [IDS]


def test_alternative_capture_fires_each_laser_alone(ranger: Ranger) -> None:
    fired: list[tuple[str, ...]] = []

    def shoot(ids: tuple[str, ...]) -> Finding:
        fired.append(ids)
        if len(ids) > 1:
            return Finding(tuple(spots(ranger, dict.fromkeys(ids[:3], 700.0))))
        return Finding(() if ids == ("L2",) else tuple(spots(ranger, dict.fromkeys(ids, 700.0))))

    reading = acquire(ranger, "s", shoot)
    assert fired == [IDS, ("L1",), ("L2",), ("L3",), ("L4",)]
    assert reading.status == "not_enough_points"
    assert [laser.laser_id for laser in reading.lasers] == ["L1", "L3", "L4"]
    assert reading.flat_mm == pytest.approx(700.0)


def captures(tmp_path: Path, *rows: str) -> Path:
    path = tmp_path / "c.csv"
    path.write_text("\n".join(["laser_id,standoff_mm,repeat,u_px,v_px,scene", *rows]) + "\n")
    return path


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


def test_a_laser_that_the_calibration_does_not_have(ranger: Ranger, tmp_path: Path) -> None:
    path = captures(tmp_path, "L9,,0,1,2,s")
    with pytest.raises(BadInputError, match="row 2, column laser_id: expected all or one of"):
        list(read_captures(ranger, load_captures(path)))
