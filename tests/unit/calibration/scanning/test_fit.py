"""Fit of a scanning head: exact data, stated deviations, and what cannot be determined."""

from __future__ import annotations

from dataclasses import replace
from math import radians
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.stats import chi2

from tests.support.scanned_head import SimulatedHead
from workbench.calibration.scanning.fit import HeadFit, HeadSpots, fit_head
from workbench.calibration.scanning.prediction import predict_head_spots
from workbench.model.arrays import FloatArray
from workbench.model.errors import BadInputError, LimitFailedError
from workbench.model.rig import load_rig

RIG = load_rig(Path(__file__).parents[4] / "rigs/scanning-head-emulated.yaml")
STANDOFFS_MM = (250.0, 400.0, 700.0, 1000.0)
READINGS_DEG = (0.0, 8.0, -8.0, 16.0, -16.0, -24.0, -32.0, -40.0)
SD_PX = 0.05
READING_SD_RAD = radians(RIG.scanning_head.reading_sd_deg)


def spots_of(seed: int) -> tuple[SimulatedHead, HeadSpots]:
    head = SimulatedHead.of(RIG, seed)
    return head, head.spots(STANDOFFS_MM, READINGS_DEG, SD_PX, np.random.default_rng(seed))


@pytest.fixture(scope="module")
def fitted() -> tuple[SimulatedHead, HeadFit]:
    head, spots = spots_of(4)
    return head, fit_head(head.rig, spots)


def objective(fit: HeadFit, values: FloatArray) -> float:
    """Half the sum of squares of data and priors at parameters (P,), with the covariances at the estimate."""
    free = fit.table.prior_sd > 0
    prior = ((values - fit.table.prior_mean)[free] / fit.table.prior_sd[free]) ** 2
    residual = fit.spots.position_px - positions(fit, values)
    covariance = (
        SD_PX**2 * np.eye(2) + READING_SD_RAD**2 * by_reading(fit)[:, :, None] * by_reading(fit)[:, None]
    )
    return float(np.einsum("ni,nij,nj->", residual, np.linalg.inv(covariance), residual) + prior.sum()) / 2


def positions(fit: HeadFit, values: FloatArray, turn_rad: float = 0.0) -> FloatArray:
    """Predicted positions (N, 2) of heads that are turned further by an angle."""
    data = fit.spots.data
    turned = data._replace(reading_rad=np.asarray(data.reading_rad) + turn_rad)
    return np.asarray(predict_head_spots(jnp.asarray(values), fit.rig.camera.lens, turned))


def by_reading(fit: HeadFit) -> FloatArray:
    """(N, 2) derivatives of the positions by the reading, px/rad, by differences."""
    step_rad = 1e-5
    return (positions(fit, fit.values, step_rad) - positions(fit, fit.values, -step_rad)) / (2 * step_rad)


def test_the_residuals_are_as_large_as_stated(fitted: tuple[SimulatedHead, HeadFit]) -> None:
    _, fit = fitted
    assert fit.noise_scale == 1.0
    assert fit.chi2 == pytest.approx(fit.degrees_of_freedom, abs=4 * np.sqrt(2 * fit.degrees_of_freedom))
    stated = np.hypot(SD_PX, READING_SD_RAD * by_reading(fit))
    np.testing.assert_allclose(fit.residual_sd_px, stated, rtol=1e-5)
    np.testing.assert_allclose(fit.residual_px, fit.spots.position_px - positions(fit, fit.values), atol=1e-9)
    # The noise of a reading moves a spot along the line.
    assert (stated[:, 0] > 1.1 * SD_PX).all()
    assert (stated[:, 1] < 1.05 * SD_PX).all()


def test_the_estimate_is_the_minimum_of_the_posterior(fitted: tuple[SimulatedHead, HeadFit]) -> None:
    """Steps along each axis of the covariance raise half the sum of squares by half their squares."""
    _, fit = fitted
    free = np.flatnonzero(fit.table.prior_sd > 0)
    scale = fit.table.prior_sd[free]
    variance, axes = np.linalg.eigh(fit.covariance[np.ix_(free, free)] / np.outer(scale, scale))
    least = objective(fit, fit.values)
    # Shorter than a deviation, so that the posterior is a parabola.
    length = 0.2
    for k in range(len(free)):
        step = np.zeros(len(fit.values))
        step[free] = length * np.sqrt(variance[k]) * axes[:, k] * scale
        both = [objective(fit, fit.values + sign * step) - least for sign in (1, -1)]
        np.testing.assert_allclose(both, length**2 / 2, rtol=0.05)


def test_the_truth_is_as_far_from_the_estimate_as_the_covariance_states() -> None:
    """Of heads drawn from the priors; the squared distance has the distribution of chi2."""
    distance2, freedom = 0.0, 0
    for seed in range(20, 32):
        head, spots = spots_of(seed)
        fit = fit_head(head.rig, spots)
        size = len(head.values)
        free = np.flatnonzero(fit.sd[:size] > 0)
        z = (fit.values[:size] - head.values)[free]
        distance2 += float(z @ np.linalg.solve(fit.covariance[np.ix_(free, free)], z))
        freedom += len(free)
    assert 1e-4 < chi2.sf(distance2, freedom) < 1 - 1e-4


def test_larger_scatter_than_stated_scales_all_deviations() -> None:
    """The result is that of a rig which states the larger noise of spots and readings."""
    head, spots = spots_of(6)
    assert fit_head(head.rig, spots).noise_scale == 1.0
    noise = np.random.default_rng(1).normal(0, 0.4, spots.position_px.shape)
    spots = replace(spots, position_px=spots.position_px + noise)
    scaled = fit_head(head.rig, spots)
    scale = scaled.noise_scale
    assert scale > 3
    own = head.rig.scanning_head
    larger = own.model_copy(update={"reading_sd_deg": scale * own.reading_sd_deg})
    honest = fit_head(head.rig.model_copy(update={"head": larger}), replace(spots, sd_px=scale * spots.sd_px))
    assert honest.noise_scale == 1.0
    assert (np.abs(scaled.values - honest.values) <= 1e-3 * honest.sd).all()
    np.testing.assert_allclose(scaled.covariance, honest.covariance, rtol=1e-3, atol=1e-12)


def test_a_placement_with_a_stated_uncertainty_has_it_as_its_prior() -> None:
    head, spots = spots_of(7)
    loose = replace(spots.placements[0], standoff_sd_mm=3.0)
    fit = fit_head(head.rig, replace(spots, placements=(loose, *spots.placements[1:])))
    names = [one.name for one in fit.table.parameters]
    assert fit.table.prior_sd[names.index("p0.error_mm")] == pytest.approx(3.0)
    assert fit.table.prior_sd[names.index("p1.error_mm")] == RIG.bench.placement_sd_mm


def test_angles_of_the_other_sign_are_named_as_a_cause() -> None:
    head, spots = spots_of(8)
    with pytest.raises(LimitFailedError, match="sign of its angle"):
        fit_head(head.rig, replace(spots, reading_deg=-spots.reading_deg))


def test_no_spot_is_an_error() -> None:
    head, spots = spots_of(9)
    none = HeadSpots(
        spots.placements, spots.placement[:0], spots.reading_deg[:0], spots.position_px[:0], spots.sd_px[:0]
    )
    with pytest.raises(BadInputError, match="no spot is left to fit"):
        fit_head(head.rig, none)
