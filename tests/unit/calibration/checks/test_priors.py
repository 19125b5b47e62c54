"""Priors against the data: false alarms, names, and the distribution of the strain."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.stats import chi2

from tests.support.message_text import numbers
from tests.support.rigs import World, thesis_rig
from workbench.calibration.checks.priors import DOUBT_P, doubted_priors, prior_strain
from workbench.calibration.estimation.fit import fit


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_strain_of_a_linear_model_is_chi_square(seed: int) -> None:
    """Unit priors and unit noise: mean n, variance 2 n; directions without data do not count."""
    rng = np.random.default_rng(seed)
    jacobian = np.zeros((12, 5))
    jacobian[:, :4] = rng.normal(0.0, 3.0, (12, 4))
    covariance = np.asarray(np.linalg.inv(np.eye(5) + jacobian.T @ jacobian), float)
    found = []
    for _ in range(4000):
        data = jacobian @ rng.normal(0.0, 1.0, 5) + rng.normal(0.0, 1.0, 12)
        found.append(prior_strain(covariance @ jacobian.T @ data, covariance, 1e-6))
    assert {one.freedom for one in found} == {4}
    chi2 = np.array([one.chi2 for one in found])
    assert chi2.mean() == pytest.approx(4.0, abs=4 * np.sqrt(8 / 4000))
    assert chi2.var() == pytest.approx(8.0, rel=0.2)


def test_priors_that_hold_are_not_doubted() -> None:
    """40 sound sensors: none (expected 0.4, by 0.5 % of each of two tests)."""
    rig = thesis_rig()
    fits = (fit(rig, World(rig, seed).observations()) for seed in range(40))
    assert [line for fitted in fits for line in doubted_priors(fitted)] == []


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_prior_that_the_data_contradict_is_named(seed: int) -> None:
    """An offset of 22 mm where the rig file says 0 +- 5; a flat determines it to less than a millimetre."""
    rig = thesis_rig()
    world = World(rig, seed)
    world.values["offset_mm"] = 22.0
    (line,) = doubted_priors(fit(rig, world.observations()))
    assert line.startswith("offset_mm = ")
    assert numbers(line)[1] == pytest.approx(22.0 / 5.0, abs=0.2)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_priors_that_only_together_contradict_the_data_are_named_in_one_line(seed: int) -> None:
    """Four beams, each 3 deviations off by its prior, which one of 21 parameters may be."""
    rig = thesis_rig()
    world = World(rig, seed)
    for laser_id, sign in zip(rig.laser_ids, (1, -1, 1, -1), strict=True):
        world.values[f"{laser_id}.ty"] = sign * 3.0 * rig.lasers[0].ty.sd
    fitted = fit(rig, world.observations())
    (line,) = doubted_priors(fitted)
    pulled, freedom = numbers(line)[:2]
    assert chi2.sf(pulled + 0.5, freedom) < DOUBT_P
    named = re.findall(r"L\d\.ty", line)
    assert len(set(named)) == 3
    assert not [name for name in set(re.findall(r"L\d\.\w+", line)) if name not in named]
