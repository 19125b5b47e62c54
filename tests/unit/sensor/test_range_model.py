"""Ranges of several spots: covariance of any of them, independence of each from the others."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.rangers import IDS, positions, thesis_ranger
from workbench.model.arrays import FloatArray
from workbench.sensor.range_model import RangeEstimates

SCENES = 40


def spots(seed: int) -> tuple[list[str], FloatArray, FloatArray]:
    """Lasers, positions and deviations of spots at random ranges."""
    rng = np.random.default_rng(seed)
    ranges = rng.uniform(150.0, 4000.0, (SCENES, len(IDS)))
    px = [positions(thesis_ranger(), dict(zip(IDS, scene, strict=True))) for scene in ranges.tolist()]
    noise = rng.normal(0.0, 0.05, (SCENES * len(IDS), 2))
    return [*IDS] * SCENES, np.concatenate(px) + noise, rng.uniform(0.02, 0.2, noise.shape)


def ranged(seed: int) -> RangeEstimates:
    return thesis_ranger().sensor.ranges(*spots(seed))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_covariance_of_some_ranges_is_a_block_of_that_of_all(seed: int) -> None:
    found = ranged(seed)
    some = np.random.default_rng(seed).permutation(SCENES * len(IDS))[:7]
    own = found.only(some)
    sigma_mm = np.sqrt(np.diag(found.covariance_mm2))[some]
    np.testing.assert_allclose(own.sigma_mm, sigma_mm, rtol=1e-12)
    # Rounding is relative to both deviations: covariances cancel, and sums depend on the matrix's size.
    block = found.covariance_mm2[np.ix_(some, some)] / np.outer(sigma_mm, sigma_mm)
    np.testing.assert_allclose(own.covariance_mm2 / np.outer(sigma_mm, sigma_mm), block, rtol=0, atol=1e-12)
    assert np.linalg.eigvalsh(own.covariance_mm2)[0] > 0


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_each_spot_is_ranged_as_if_it_were_alone(seed: int) -> None:
    """The iteration goes on until all have converged; those that have converged stay."""
    (ids, px, sd), found = spots(seed), ranged(seed)
    sensor = thesis_ranger().sensor
    for n in range(0, len(ids), 9):
        alone = sensor.ranges(ids[n : n + 1], px[n : n + 1], sd[n : n + 1])
        own = found.only(np.array([n]))
        np.testing.assert_allclose(own.range_mm, alone.range_mm, rtol=1e-12)
        np.testing.assert_allclose(own.sigma_mm, alone.sigma_mm, rtol=1e-12)
        np.testing.assert_allclose(own.by_parameter, alone.by_parameter, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(own.misfit_sd, alone.misfit_sd, rtol=1e-12, atol=1e-12)
