"""Comparing calibrations: nothing moved, one thing moved, and what cannot be compared."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.rigs import PROVENANCE, World, thesis_rig
from workbench.calibration.estimation.fit import fit
from workbench.calibration.verdict.comparison import Comparison, compare
from workbench.calibration.verdict.export import calibrate
from workbench.model.acceptance import Acceptance
from workbench.model.calibration import Calibration
from workbench.model.errors import BadInputError


def calibration_of(world: World, session: int) -> Calibration:
    """One session's calibration of a world: same sensor, new placements and noise."""
    return calibrate(fit(world.rig, world.observations(session=session)), Acceptance(), PROVENANCE)[0]


def moved(seed: int, **change: float) -> Comparison:
    world = World(thesis_rig(), seed)
    before = calibration_of(world, 1)
    for name, step in change.items():
        world.values[name.replace("__", ".")] += step
    return compare(before, calibration_of(world, 2))


@pytest.mark.thorough
def test_two_sessions_of_one_sensor_agree_as_often_as_chance_says() -> None:
    probabilities = np.array([moved(seed).probability for seed in range(30)])
    # One in a hundred by chance: 3 or more of 30 would happen once in 300.
    assert (probabilities < 0.01).sum() <= 2
    # And not because the deviations are far too wide: half of the probabilities lie below one half, give or
    # take three times sqrt(30 / 4) = 2.7; shared priors push them up a little.
    assert 5 <= (probabilities < 0.5).sum() <= 23


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_laser_that_was_bent_is_named(seed: int) -> None:
    result = moved(seed, L2__tx=0.003)
    assert result.moved
    assert result.explanations[0] in {"L2.tx", "L2.x_mm"}
    worst = max(result.differences, key=lambda d: abs(d.difference_mm) / d.sd_mm)
    assert worst.laser_id == "L2"


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_reference_plane_that_moved_is_named(seed: int) -> None:
    result = moved(seed, offset_mm=4.0)
    assert result.moved
    assert result.explanations[0] == "offset_mm"
    near = [d for d in result.differences if d.range_mm < 400]
    assert np.mean([d.difference_mm for d in near]) == pytest.approx(-4.0, abs=0.5)


def test_a_calibration_and_itself() -> None:
    calibration = calibration_of(World(thesis_rig(), 1), 1)
    result = compare(calibration, calibration)
    assert result.chi2 == pytest.approx(0.0, abs=1e-9)
    assert not result.moved


def test_other_lasers_cannot_be_compared() -> None:
    calibration = calibration_of(World(thesis_rig(), 1), 1)
    ranger = calibration.laser_ranger
    other = calibration.model_copy(
        update={"laser_ranger": ranger.model_copy(update={"lasers": ranger.lasers[:2]})}
    )
    with pytest.raises(BadInputError, match="lasers: expected the same"):
        compare(calibration, other)


def test_standoffs_without_an_overlap() -> None:
    calibration = calibration_of(World(thesis_rig(), 1), 1)
    ranger = calibration.laser_ranger
    validity = ranger.validity.model_copy(update={"standoff_mm": (5000.0, 6000.0)})
    other = calibration.model_copy(update={"laser_ranger": ranger.model_copy(update={"validity": validity})})
    with pytest.raises(BadInputError, match="standoffs in common"):
        compare(calibration, other)
