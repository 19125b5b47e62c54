"""Assignment of spots to lasers: right or refused."""

from __future__ import annotations

from itertools import permutations
from math import log, sqrt
from typing import cast

import numpy as np
import pytest

from tests.support.rangers import IDS, X_MM, positions, ranger_in
from tests.support.rigs import World, thesis_rig
from workbench.model.arrays import FloatArray
from workbench.ranging.assignment import LaserSpotPairs, assign, pair_up
from workbench.ranging.assignment_kernels import assignments
from workbench.ranging.ranger import Ranger
from workbench.sensor.range_model import RangeEstimates


def dealt(ranger: Ranger, pixels: np.ndarray, sd_px: float = 0.05) -> tuple[str, ...] | None:
    """The lasers of the spots, in the order of the spots; None where they are not told."""
    pairs = pair_up(ranger.sensor, pixels, np.full(pixels.shape, sd_px))
    found = assign(pairs, np.arange(len(ranger.sensor.ids)))
    if found is None:
        return None
    by_spot = dict(zip(found[1].tolist(), found[0].tolist(), strict=True))
    return tuple(ranger.sensor.ids[by_spot[n]] for n in sorted(by_spot))


@pytest.mark.parametrize("range_mm", [150.0, 600.0, 2500.0, 4000.0])
def test_spots_of_a_flat_are_dealt_in_any_order(ranger: Ranger, range_mm: float) -> None:
    pixels = positions(ranger, dict.fromkeys(IDS, range_mm))
    for order in permutations(range(4)):
        expected = tuple(IDS[i] for i in order)
        assert dealt(ranger, pixels[list(order)]) == expected


@pytest.mark.parametrize("angle_deg", [-45.0, 30.0, 60.0])
def test_spots_of_an_incline_are_dealt(ranger: Ranger, angle_deg: float) -> None:
    slope = np.tan(np.radians(angle_deg))
    tilted = {i: 500.0 + slope * x for i, x in zip(IDS, X_MM, strict=True)}
    assert dealt(ranger, positions(ranger, tilted)) == IDS


def test_spots_that_fit_two_ways_are_not_dealt(ranger: Ranger) -> None:
    """Two spots in one place can be swapped at will."""
    pixels = positions(ranger, {"L1": 500.0, "L2": 500.0, "L3": 500.0, "L4": 500.0})
    pixels[1] = pixels[0]
    assert dealt(ranger, pixels) is None


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_steps_in_depth_are_dealt_rightly_or_not_at_all(seed: int) -> None:
    """A post before a wall, and one laser of a flat on another surface: where a swap could deceive."""
    world = World(thesis_rig(), seed)
    ranger = ranger_in(world)
    rng = np.random.default_rng(seed)
    right = wrong = 0
    for _ in range(150):
        depths = np.full(4, rng.uniform(300.0, 3000.0))
        depths[rng.integers(4)] *= rng.uniform(0.5, 2.0)
        at = zip(IDS, depths + world.values["offset_mm"], strict=True)
        pixels = np.array([world.pixel(i, z) for i, z in at]) + rng.normal(0.0, 0.05, (4, 2))
        told = dealt(ranger, pixels, 0.03)
        right += told == IDS
        wrong += told not in (None, IDS)
    assert wrong == 0
    assert right > 75


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("missing", [1, 2])
def test_missing_spots_leave_the_others_told(seed: int, missing: int) -> None:
    """Lasers aligned by eye do not share a line: that tells their spots apart, steps in depth included."""
    world = World(thesis_rig(), seed)
    ranger = ranger_in(world)
    rng = np.random.default_rng([seed, missing])
    right = wrong = 0
    for _ in range(100):
        depths = np.full(4, rng.uniform(300.0, 3000.0))
        depths[rng.integers(4)] *= rng.uniform(0.5, 2.0)
        seen = np.sort(rng.permutation(4)[missing:])
        at = [world.pixel(IDS[n], depths[n] + world.values["offset_mm"]) for n in seen]
        told = dealt(ranger, np.array(at) + rng.normal(0.0, 0.05, (len(seen), 2)), 0.03)
        expected = tuple(IDS[n] for n in seen)
        right += told == expected
        wrong += told not in (None, expected)
    assert wrong == 0
    assert right >= 95


def test_on_one_line_three_spots_of_a_flat_are_told_and_two_are_not(coplanar: Ranger) -> None:
    """The inner pair of a flat at 1 m is the outer pair of a flat at 2 m."""
    for gone in IDS:
        seen = [i for i in IDS if i != gone]
        assert dealt(coplanar, positions(coplanar, dict.fromkeys(seen, 900.0))) == tuple(seen)
    assert dealt(coplanar, positions(coplanar, {"L2": 1000.0, "L3": 1000.0})) is None
    assert dealt(coplanar, positions(coplanar, {"L2": 1000.0})) is None


def test_more_spots_than_lasers_are_not_dealt(coplanar: Ranger) -> None:
    flat = positions(coplanar, dict.fromkeys(IDS, 900.0))
    assert dealt(coplanar, np.vstack((flat, flat[:1] + np.array([9.0, 0.0])))) is None


def lasers_of(misfit_sd: FloatArray, inverse_depth: FloatArray) -> tuple[int, ...] | None:
    """Laser of each spot, (L, S) pairs given; None where the assignment is ambiguous."""
    pairs = LaserSpotPairs(cast(RangeEstimates, None), inverse_depth, misfit_sd)
    found = assign(pairs, np.arange(len(misfit_sd)))
    return None if found is None else tuple(found[0].tolist())


@pytest.mark.parametrize(("p", "assigned"), [(1.1e-4, True), (0.9e-4, False)])
def test_distances_from_the_lines_are_a_chi_square(p: float, assigned: bool) -> None:
    """Of two equal distances d: exp(-d^2) is the probability of larger ones."""
    distance = sqrt(-log(p))
    misfit = np.where(np.eye(2, dtype=bool), distance, np.inf)
    assert lasers_of(misfit, np.ones((2, 2))) == ((0, 1) if assigned else None)


def test_a_spot_off_all_lines_is_other_light_and_one_hardly_on_a_line_is_improbable() -> None:
    assert lasers_of(np.array([[6.1], [9.0]]), np.ones((2, 1))) == ()
    assert lasers_of(np.array([[5.9], [9.0]]), np.ones((2, 1))) is None


@pytest.mark.parametrize(("ratio", "assigned"), [(1.9, False), (2.1, True)])
def test_of_two_assignments_the_even_surface_is_clearly_more_even(ratio: float, assigned: bool) -> None:
    even, uneven = 0.02, 0.02 * ratio
    inverse_depth = np.array([[1.0 - even, 1.0 + uneven], [1.0 - uneven, 1.0 + even]])
    assert lasers_of(np.zeros((2, 2)), inverse_depth) == ((0, 1) if assigned else None)
    assert lasers_of(np.zeros((2, 2)), inverse_depth[::-1]) == ((1, 0) if assigned else None)


@pytest.mark.parametrize(
    ("spots", "spread", "assigned"), [(3, 0.045, True), (3, 0.055, False), (2, 0.001, False)]
)
def test_where_spots_are_missing_three_lie_on_an_even_surface(
    spots: int, spread: float, assigned: bool
) -> None:
    """Relative spread of the inverse depths of the first lasers; all others are far from even."""
    inverse_depth = np.outer(2.0 ** np.arange(1, 5), 3.0 ** np.arange(1, spots + 1))
    steps = np.linspace(-1.0, 1.0, spots)
    np.fill_diagonal(inverse_depth, 1.0 + spread * steps / steps.std())
    expected = tuple(range(spots)) if assigned else None
    assert lasers_of(np.zeros((4, spots)), inverse_depth) == expected


@pytest.mark.parametrize(("lasers", "assigned"), [(6, True), (7, False)])
def test_six_lasers_on_one_line_are_told_apart_at_most(lasers: int, assigned: bool) -> None:
    """With the spots of an even surface, and all others far from even."""
    inverse_depth = np.outer(2.0 ** np.arange(lasers), 3.0 ** np.arange(lasers))
    np.fill_diagonal(inverse_depth, 1.0)
    expected = tuple(range(lasers)) if assigned else None
    assert lasers_of(np.zeros((lasers, lasers)), inverse_depth) == expected


@pytest.mark.parametrize("lasers", [7, 15])
def test_any_number_of_lasers_is_told_apart_by_their_lines(lasers: int) -> None:
    misfit = np.where(np.eye(lasers, dtype=bool), 0.0, np.inf)
    assert lasers_of(misfit, np.ones((lasers, lasers))) == tuple(range(lasers))


@pytest.mark.parametrize(("lasers", "spots"), [(1, 1), (4, 4), (4, 2), (6, 5)])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_assignments_are_the_permutations_of_possible_pairs(lasers: int, spots: int, seed: int) -> None:
    possible = np.random.default_rng(seed).random((lasers, spots)) < 0.7
    expected = [
        one
        for one in permutations(range(lasers), spots)
        if all(possible[laser, n] for n, laser in enumerate(one))
    ]
    found = assignments(possible, 720)
    assert [tuple(one) for one in found.tolist()] == expected
    assert len(assignments(possible, 1)) == min(len(expected), 2)
