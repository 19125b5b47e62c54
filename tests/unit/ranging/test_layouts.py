"""Layouts other than one line beside the camera: calibrated, assigned, ranged, and the shape of each row.

The truth is that of `World`: rays, planes and OpenCV's lens, independent of `workbench.optics`.
"""

from __future__ import annotations

from functools import cache
from math import degrees, radians, tan
from pathlib import Path

import numpy as np
import pytest

from tests.support.rangers import ranger_in, spot_at
from tests.support.rigs import World
from workbench.model.rig import load_rig
from workbench.ranging.ranger import Ranger, Reading
from workbench.spots import Spot

ROOT = Path(__file__).parents[3]
RIGS = ("diagonal", "three-lines", "ring", "mars-rover")
SEEDS = (1, 2, 3)
SD_PX = 0.03
"""Noise of a spot, as `spot_at` states it."""
RANGES_MM = (200.0, 450.0, 1000.0, 2200.0)


@cache
def sensor_of(layout: str, seed: int) -> tuple[Ranger, World]:
    """A sensor drawn from a rig's tolerances; of a grating all beams have one origin and one turn."""
    rig = load_rig(ROOT / f"rigs/{layout}-emulated.yaml")
    world = World(rig, seed)
    rng = np.random.default_rng([seed, 9])
    for group in rig.emitters:
        if len(group) > 1:
            common = rng.normal(size=4) * (0.2, 0.2, 0.005, 0.005)
            for laser in group:
                for name, error in zip(("x_mm", "y_mm", "tx", "ty"), common, strict=True):
                    world.values[f"{laser.id}.{name}"] = getattr(laser, name).value + error
    return ranger_in(world), world


def seen(
    world: World, range_mm: float, yaw_deg: float, pitch_deg: float, rng: np.random.Generator
) -> list[Spot]:
    """Spots of all lasers on a plane, in a random order."""
    z0 = range_mm + world.values["offset_mm"]
    exact = [world.pixel(i, z0, radians(yaw_deg), radians(pitch_deg)) for i in world.rig.laser_ids]
    pixels = np.array(exact) + rng.normal(0.0, SD_PX, (len(exact), 2))
    return [spot_at(u, v) for u, v in rng.permutation(pixels).tolist()]


def true_range_mm(world: World, laser_id: str, range_mm: float, yaw_deg: float, pitch_deg: float) -> float:
    """Range of a beam's point on a plane that meets the axis at `range_mm`, by the ray equation."""
    x, y, tx, ty = (world.values[f"{laser_id}.{name}"] for name in ("x_mm", "y_mm", "tx", "ty"))
    mx, my = tan(radians(yaw_deg)), tan(radians(pitch_deg))
    depth = (range_mm + world.values["offset_mm"] + mx * x + my * y) / (1 - mx * tx - my * ty)
    return float(depth - world.values["offset_mm"])


def read(layout: str, seed: int, range_mm: float, yaw_deg: float, pitch_deg: float) -> tuple[Reading, World]:
    ranger, world = sensor_of(layout, seed)
    rng = np.random.default_rng([seed, int(range_mm), int(yaw_deg) + 90, int(pitch_deg) + 90])
    return ranger.read_lit("s", seen(world, range_mm, yaw_deg, pitch_deg, rng)), world


@pytest.mark.long_cases
@pytest.mark.parametrize("layout", RIGS)
def test_spots_in_any_order_are_assigned_and_ranged_within_their_intervals(layout: str) -> None:
    """95 % of the intervals contain the truth; calibration errors are common to the ranges of one sensor."""
    inside = total = 0
    for seed in SEEDS:
        for range_mm in RANGES_MM:
            reading, world = read(layout, seed, range_mm, 12.0, -8.0)
            assert reading.status == "done", (seed, range_mm, reading.notes)
            for one in reading.lasers:
                true = true_range_mm(world, one.laser_id, range_mm, 12.0, -8.0)
                assert abs(one.range_mm - true) < 5 * one.sigma_mm
                assert one.low_mm is not None
                inside += one.low_mm <= true <= (one.high_mm or np.inf)
                total += 1
    # Of 48 ranges or more; errors of a calibration are shared, hence the margin.
    assert inside / total > 0.85


@pytest.mark.parametrize("layout", ["diagonal", "three-lines", "mars-rover"])
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(("yaw_deg", "pitch_deg"), [(25.0, 0.0), (0.0, 25.0), (20.0, -30.0)])
def test_each_row_shows_the_slope_of_a_plane_along_it(
    layout: str, seed: int, yaw_deg: float, pitch_deg: float
) -> None:
    """The cut of a plane with the slopes (mx, my) along a direction (cx, cy) has the slope mx cx + my cy."""
    reading, _ = read(layout, seed, 450.0, yaw_deg, pitch_deg)
    ranger, _ = sensor_of(layout, seed)
    assert len(reading.lines) == len(ranger.sensor.rows)
    for line in reading.lines:
        angle = radians(line.row.angle_deg)
        slope = tan(radians(yaw_deg)) * np.cos(angle) + tan(radians(pitch_deg)) * np.sin(angle)
        assert line.shape.angle_rad is not None
        assert line.shape.angle_sigma_rad is not None
        # Beams that are 5 mrad out of the row's plane shift the ranges by that times the slope across it.
        bump = 0.005 * 450.0 * 3 * (tan(radians(25.0)) if layout != "mars-rover" else 0.1) / 60.0
        allowed = 4 * line.shape.angle_sigma_rad + bump
        assert abs(line.shape.angle_rad - np.arctan(slope)) < allowed, (line.row.name, degrees(slope))


@pytest.mark.parametrize("seed", SEEDS)
def test_lasers_on_no_row_give_ranges_without_a_shape(seed: int) -> None:
    reading, world = read("ring", seed, 600.0, 0.0, 0.0)
    assert [line.shape.kind for line in reading.lines] == ["unknown"] * len(world.rig.lasers)
    assert reading.closest_mm == min(one.range_mm for one in reading.lasers)
    assert len(reading.lasers) == len(world.rig.lasers)
    (nearest,) = reading.shapes
    assert nearest.shape.closest_mm == reading.closest_mm


@pytest.mark.parametrize("seed", SEEDS)
def test_a_step_in_depth_does_not_exchange_the_spots_of_a_ring(seed: int) -> None:
    """Each laser of a ring has a line of its own: any ranges are assigned."""
    ranger, world = sensor_of("ring", seed)
    rng = np.random.default_rng(seed)
    for _ in range(20):
        ranges = dict(
            zip(world.rig.laser_ids, rng.uniform(250.0, 1500.0, len(world.rig.lasers)), strict=True)
        )
        offset = world.values["offset_mm"]
        spots = [spot_at(*world.pixel(i, at + offset).tolist()) for i, at in ranges.items()]
        reading = ranger.read_lit("s", spots)
        assert {one.laser_id: one.range_mm for one in reading.lasers} == pytest.approx(ranges, rel=0.02)


def test_the_front_of_a_grating_is_that_of_its_spots_and_of_parallel_beams_that_of_the_lasers() -> None:
    fan, _ = sensor_of("mars-rover", 1)
    (row,) = fan.sensor.rows
    for range_mm in (300.0, 1200.0):
        places = row.direction @ fan.sensor.positions_mm(fan.sensor.ids, np.full(15, range_mm))
        assert fan.sensor.front_mm(row, range_mm) == pytest.approx((places.min(), places.max()))
    line, _ = sensor_of("diagonal", 1)
    (row,) = line.sensor.rows
    assert line.sensor.front_mm(row, 300.0) == pytest.approx((-60.0, 60.0), abs=1.0)
    assert line.sensor.front_mm(row, 300.0) == line.sensor.front_mm(row, 4000.0)
