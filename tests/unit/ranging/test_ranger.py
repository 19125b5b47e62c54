"""The ranger's answers to spots."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass

import numpy as np
import pytest
from pydantic import BaseModel

from tests.support.rangers import IDS, positions, spot_at, spots
from workbench.ranging.alone import spots_on_line
from workbench.ranging.ranger import KnownSpots, Ranger


def test_a_spot_on_no_laser_s_line_is_other_light(ranger: Ranger) -> None:
    astray = spot_at(300.0, 60.0)
    reading = ranger.read_lit("s", [*spots(ranger, dict.fromkeys(IDS, 800.0)), astray])
    assert reading.status == "done"
    assert reading.notes == ("1 of 5 spots on no laser's line: other light",)
    alone = ranger.read_lit("s", [astray])
    assert (alone.status, alone.closest_mm) == ("no_points", None)


def test_a_flat(ranger: Ranger) -> None:
    reading = ranger.read_lit("s", spots(ranger, dict.fromkeys(IDS, 800.0)))
    assert reading.status == "done"
    assert [laser.laser_id for laser in reading.lasers] == list(IDS)
    assert reading.closest_mm == pytest.approx(800.0, abs=0.1)
    assert reading.flat_mm == pytest.approx(800.0)
    assert reading.flat_sigma_mm is not None
    assert reading.sigma_mm is not None
    assert reading.flat_sigma_mm < min(laser.sigma_mm for laser in reading.lasers)
    assert reading.flat_sigma_mm == pytest.approx(reading.sigma_mm, rel=0.1)
    (line,) = reading.lines
    assert (line.row.name, line.shape.kind) == ("horizontal", "flat")
    assert reading.mean_mm == reading.closest_mm


def test_the_closest_is_at_the_near_end_of_an_incline(ranger: Ranger) -> None:
    reading = ranger.read_lit("s", spots(ranger, {"L1": 520.0, "L2": 510.0, "L3": 490.0, "L4": 480.0}))
    (line,) = reading.lines
    assert line.shape.kind == "incline"
    # Beams that are not parallel shift the spots by some millimetres along the front.
    assert reading.closest_mm == pytest.approx(480.0, abs=1.5)
    assert line.shape.angle_rad == pytest.approx(-np.arctan(40 / 120), abs=0.01)


@pytest.mark.parametrize("count", [0, 1, 3, 5])
def test_not_as_many_spots_as_lasers(coplanar: Ranger, count: int) -> None:
    ranger = coplanar
    flat = (
        spots(ranger, dict.fromkeys(IDS, 800.0))
        if count != 3
        else spots(ranger, {"L1": 800.0, "L2": 1300.0, "L3": 500.0, "L4": 800.0})
    )
    seen = (flat * 2)[:count]
    reading = ranger.read_lit("s", seen)
    assert reading.status == ("not_enough_points" if count else "no_points")
    assert reading.closest_mm is None
    assert reading.lasers == ()
    note = "more spots than lasers: check that this is the calibration of this sensor"
    too_many = [note] if count == 5 else []
    assert list(reading.notes[1:]) == too_many


def test_lasers_fired_alone_with_one_missing(ranger: Ranger) -> None:
    pixels = positions(ranger, {"L1": 800.0, "L4": 805.0})
    reading = ranger.read_known("s", 3, ["L1", "L4"], pixels, np.full((2, 2), np.nan))
    assert reading.status == "not_enough_points"
    assert reading.interval_mm is not None
    assert reading.interval_mm[0] < 750.0, "a round surface between the two may be closer"
    assert 800.0 < reading.interval_mm[1] < 810.0
    assert reading.lasers[0].range_mm == pytest.approx(800.0)


def test_a_laser_whose_spot_lies_beyond_infinity_does_not_count(ranger: Ranger) -> None:
    pixels = positions(ranger, {"L1": 800.0, "L4": np.inf}) - [[0.0, 0.0], [3.0, 0.0]]
    reading = ranger.read_known("s", 2, ["L1", "L4"], pixels, np.full((2, 2), 0.05))
    assert [laser.laser_id for laser in reading.lasers] == ["L1"]
    assert reading.status == "not_enough_points"
    assert reading.flat_mm == pytest.approx(800.0)


def test_a_scanline_holds_a_laser_s_spots_from_the_nearest_standoff_to_infinity(ranger: Ranger) -> None:
    nearest, _ = ranger.calibration.laser_ranger.validity.standoff_mm
    ranges = np.append(np.geomspace(nearest, 1e6, 30), np.inf)
    for laser_id, line in zip(IDS, ranger.scanlines, strict=True):
        u, v = ranger.sensor.spot_px(laser_id, ranges).T
        across = ((u - line.u0_px) * line.dv - (v - line.v0_px) * line.du) / np.hypot(line.du, line.dv)
        assert np.abs(across).max() < line.half_width_px - 7.0
        along = ((u - line.u0_px) * line.du + (v - line.v0_px) * line.dv) / (line.du**2 + line.dv**2)
        assert along[[0, -1]] == pytest.approx([1.0, 0.0])


def test_lasers_of_one_line_are_searched_for_in_one_band_and_one_alone_on_its_own(ranger: Ranger) -> None:
    (all_of_them,) = ranger.searched(IDS)
    assert ranger.searched(["L3"]) == [ranger.scanlines[2]]
    assert all_of_them.half_width_px >= max(line.half_width_px for line in ranger.scanlines)


def test_of_a_laser_fired_alone_only_spots_on_its_line_are_kept(ranger: Ranger) -> None:
    (own,) = spots(ranger, {"L1": 800.0})
    assert spots_on_line(ranger.sensor, [("L1", [spot_at(own.u_px, own.v_px + 40.0), own])]) == [[own]]
    assert spots_on_line(ranger.sensor, [("L1", [])]) == [[]]
    assert spots_on_line(
        ranger.sensor, [("L1", [own]), ("L2", []), ("L1", [spot_at(own.u_px, own.v_px + 40.0)])]
    ) == [
        [own],
        [],
        [],
    ]
    # Beyond the image of the laser's point at infinity no target can lie.
    (u, v) = ranger.sensor.spot_px("L1", np.array([np.inf]))[0]
    assert spots_on_line(ranger.sensor, [("L1", [spot_at(u + 5.0, v), own])]) == [[own]]


def known_spots(ranger: Ranger, scenes: int, seed: int) -> list[KnownSpots]:
    """Scenes of inclined and bent surfaces, some with missing spots, lost coordinates, or beyond infinity."""
    rng = np.random.default_rng(seed)
    found = []
    for n in range(scenes):
        lasers = rng.permutation(IDS)[: rng.integers(1, 5)].tolist()
        near, slope = 10.0 ** rng.uniform(2.2, 3.6), rng.normal(0.0, 0.5)
        px = positions(ranger, {i: near * (1.0 + 0.1 * slope * rng.normal()) for i in lasers})
        px += rng.normal(0.0, 0.06, px.shape)
        if n % 7 == 0:
            px[0, 0] += 4.0 * rng.normal()
        if n % 5 == 0:
            px[-1, 1] = np.nan
        sd = np.where(rng.uniform(size=px.shape) < 0.2, np.nan, rng.uniform(0.02, 0.1, px.shape))
        found.append(KnownSpots(f"s{n}", 4, lasers, px, sd, np.full(px.shape, np.nan)))
    return found


def values(thing: object) -> Iterator[object]:
    """All numbers and texts of a reading, in order."""
    if is_dataclass(thing) and not isinstance(thing, type):
        thing = [getattr(thing, field.name) for field in fields(thing)]
    elif isinstance(thing, BaseModel):
        thing = list(thing.model_dump().values())
    elif isinstance(thing, dict):
        thing = [*thing, *thing.values()]
    elif isinstance(thing, np.ndarray):
        thing = thing.tolist()
    if isinstance(thing, (list, tuple)):
        for one in thing:
            yield from values(one)
    else:
        yield thing


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_scenes_ranged_together_have_the_readings_of_each_alone(ranger: Ranger, seed: int) -> None:
    """To 1e-12, although the spots are ranged in one iteration."""
    scenes = known_spots(ranger, 60, seed)
    together = ranger.read_scenes(scenes)
    assert [reading.scene for reading in together] == [scene.scene for scene in scenes]
    assert {reading.status for reading in together} >= {"done", "not_enough_points"}
    for one, scene in zip(together, scenes, strict=True):
        (alone,) = ranger.read_scenes([scene])
        ours, others = [*values(one)], [*values(alone)]
        assert [v for v in ours if not isinstance(v, float)] == [
            v for v in others if not isinstance(v, float)
        ]
        numbers, expected = ([v for v in some if isinstance(v, float)] for some in (ours, others))
        np.testing.assert_allclose(numbers, expected, rtol=1e-12, atol=1e-12)


def test_no_scenes_have_no_readings(ranger: Ranger) -> None:
    assert ranger.read_scenes([]) == []
