"""A step of the target between its captures: where, how far, and what is no step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.support.corrupted_data import moved, shifted, stated_as
from tests.support.rigs import STANDOFFS_MM, World, thesis_rig
from workbench.calibration.checks import target_motion
from workbench.calibration.checks.target_motion import find_target_motion
from workbench.calibration.data.observations import Observation
from workbench.calibration.estimation.fit import fit

RIG = thesis_rig()
SEEDS = (1, 2, 3)
EVERY = range(len(STANDOFFS_MM))


def captures_at(observations: list[Observation], standoff_mm: float) -> list[str]:
    return [s.source for s in observations if s.standoff_mm == standoff_mm]


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(("standoff_mm", "after", "step_mm"), [(160.0, 8, 2.0), (900.0, 12, -15.0)])
def test_a_step_is_found_with_its_place_and_its_size(
    seed: int, standoff_mm: float, after: int, step_mm: float
) -> None:
    world = World(RIG, seed)
    observations = moved(world, world.observations(), standoff_mm, after, step_mm)
    index = STANDOFFS_MM.index(standoff_mm)
    (found,) = find_target_motion(fit(RIG, observations), [index])
    sources = captures_at(observations, standoff_mm)
    assert found.placement == index
    assert (found.before, found.captures) == (after, len(sources))
    assert (found.last_before, found.first_after) == (sources[after - 1], sources[after])
    assert found.step_mm == pytest.approx(step_mm, abs=4 * found.sd_mm)
    assert found.sd_mm < 0.1 * abs(step_mm)
    if standoff_mm < 200:
        # Twice the logarithm of some centimetres over the deviation of a near step, to odds of five to one.
        cost = 2 * np.log(50.0 / found.sd_mm)
        assert pytest.approx(cost, abs=2 * np.log(5)) == target_motion.STEP_COST


@pytest.mark.parametrize("seed", SEEDS)
def test_targets_that_stood_still_did_not_move(seed: int) -> None:
    assert find_target_motion(fit(RIG, World(RIG, seed).observations()), EVERY) == ()


@pytest.mark.parametrize("seed", SEEDS)
def test_the_noise_of_repeats_is_their_scatter_before_and_after_a_step(seed: int) -> None:
    """Repeats 0 to 2 of L2 lie apart from 3 to 5; the scatter within the two is that of the noise."""
    world = World(RIG, seed)
    plain = world.observations(repeats=6)
    fitted = fit(RIG, shifted(plain, "L2", 600.0, 8.0 * RIG.noise.spot_sd_px, (3, 4, 5)))
    (cell,) = fitted.cells.inconsistent
    repeats = np.array([(s.u_px, s.v_px) for s in plain if (s.laser_id, s.standoff_mm) == ("L2", 600.0)])
    parts = repeats[:3], repeats[3:]
    square = sum(((part - part.mean(axis=0)) ** 2).sum() for part in parts) / RIG.noise.spot_sd_px**2
    # Four means of three positions each are subtracted from twelve coordinates.
    scatter = np.sqrt(square / (12 - 4))
    usual = fitted.cells.repeat_scale
    assert target_motion._repeat_scale(fitted, cell) == pytest.approx(max(usual, scatter))
    assert {target_motion._repeat_scale(fitted, n) for n in range(4)} - {cell} == {usual}


def test_only_suspects_are_looked_at() -> None:
    world = World(RIG, 1)
    fitted = fit(RIG, moved(world, world.observations(), 160.0, 8, 2.0))
    assert find_target_motion(fitted, [5, 6]) == ()


@pytest.mark.parametrize("seed", SEEDS)
def test_a_wrong_standoff_is_no_step(seed: int) -> None:
    fitted = fit(RIG, stated_as(World(RIG, seed).observations(), 400.0, 410.0))
    index = [p.standoff_mm for p in fitted.cells.placements].index(410.0)
    assert find_target_motion(fitted, [index]) == ()


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("repeats", [range(5), (3, 4)])
def test_one_wrong_spot_is_no_step(seed: int, repeats: tuple[int, ...] | range) -> None:
    fitted = fit(RIG, shifted(World(RIG, seed).observations(), "L4", 400.0, 3.0, repeats))
    assert find_target_motion(fitted, [STANDOFFS_MM.index(400.0)]) == ()


@pytest.mark.parametrize("after", [5, 15])
def test_a_step_that_sets_one_laser_apart_may_be_a_wrong_spot(after: int) -> None:
    """Five captures of L1 come first, five of L4 last."""
    world = World(RIG, 1)
    fitted = fit(RIG, moved(world, world.observations(), 900.0, after, -15.0))
    assert find_target_motion(fitted, [STANDOFFS_MM.index(900.0)]) == ()


@pytest.mark.parametrize("after", [2, 18])
def test_two_captures_on_one_side_are_enough(after: int) -> None:
    world = World(RIG, 1)
    fitted = fit(RIG, moved(world, world.observations(), 160.0, after, 2.0))
    (found,) = find_target_motion(fitted, [STANDOFFS_MM.index(160.0)])
    assert (found.before, found.captures) == (after, 20)
    assert found.step_mm == pytest.approx(2.0, abs=4 * found.sd_mm)


def test_a_step_needs_two_captures_on_either_side() -> None:
    world = World(RIG, 1)
    few = [s for s in world.observations(repeats=1) if s.standoff_mm != 400.0 or s.laser_id != "L1"]
    index = STANDOFFS_MM.index(400.0)
    assert len(captures_at(few, 400.0)) == 3
    assert find_target_motion(fit(RIG, moved(world, few, 400.0, 1, 20.0)), [index]) == ()


def test_the_step_of_the_only_placement_cannot_be_judged() -> None:
    world = World(RIG, 1)
    observations = moved(world, world.observations((400.0,)), 400.0, 8, 5.0)
    assert find_target_motion(fit(RIG, observations), [0]) == ()


def test_a_coordinate_that_is_missing_does_not_hide_a_step() -> None:
    world = World(RIG, 2)
    observations = moved(world, world.observations(), 160.0, 8, 2.0)
    blind = [replace(s, v_px=float("nan")) if s.repeat == 1 else s for s in observations]
    (found,) = find_target_motion(fit(RIG, blind), [STANDOFFS_MM.index(160.0)])
    assert found.before == 8
    assert np.sign(found.step_mm) == 1
