"""Fit of a scanning head: exact data, stated deviations, and what cannot be determined."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.scanned_head import SimulatedHead
from workbench.calibration.scanning.fit import HeadFit, HeadSpots, fit_head
from workbench.model.errors import BadInputError, LimitFailedError
from workbench.model.rig import load_rig

RIG = load_rig(Path(__file__).parents[4] / "rigs/scanning-head-emulated.yaml")
STANDOFFS_MM = (250.0, 400.0, 700.0, 1000.0)
READINGS_DEG = (0.0, 8.0, -8.0, 16.0, -16.0, -24.0, -32.0, -40.0)
SD_PX = 0.05


def spots_of(seed: int) -> tuple[SimulatedHead, HeadSpots]:
    head = SimulatedHead.of(RIG, seed)
    return head, head.spots(STANDOFFS_MM, READINGS_DEG, SD_PX, np.random.default_rng(seed))


@pytest.fixture(scope="module")
def fitted() -> tuple[SimulatedHead, HeadFit]:
    head, spots = spots_of(4)
    return head, fit_head(head.rig, spots)


def test_the_residuals_are_as_large_as_stated(fitted: tuple[SimulatedHead, HeadFit]) -> None:
    _, fit = fitted
    assert fit.noise_scale == 1.0
    assert fit.chi2 == pytest.approx(fit.degrees_of_freedom, abs=4 * np.sqrt(2 * fit.degrees_of_freedom))
    assert fit.residual_px.shape == fit.residual_sd_px.shape == fit.spots.position_px.shape
    # The noise of a reading moves a spot along the line only.
    assert (fit.residual_sd_px[:, 0] > 1.1 * SD_PX).all()
    np.testing.assert_allclose(fit.residual_sd_px[:, 1], SD_PX, rtol=0.05)


def test_the_estimate_is_the_minimum_of_the_posterior(fitted: tuple[SimulatedHead, HeadFit]) -> None:
    """Steps along the axes of the posterior raise the sum of squares by one half of a unit each way."""
    head, fit = fitted
    truth = head.values
    size = len(truth)
    free = fit.sd[:size] > 0
    z = (fit.values[:size] - truth)[free]
    distance2 = z @ np.linalg.solve(fit.covariance[:size, :size][np.ix_(free, free)], z)
    assert distance2 < free.sum() + 5 * np.sqrt(2 * free.sum())


def test_larger_scatter_than_stated_scales_all_deviations() -> None:
    head, spots = spots_of(6)
    plain = fit_head(head.rig, spots)
    noise = np.random.default_rng(1).normal(0, 0.4, spots.position_px.shape)
    scaled = fit_head(head.rig, replace(spots, position_px=spots.position_px + noise))
    assert plain.noise_scale == 1.0
    assert scaled.noise_scale > 3
    assert (scaled.sd[scaled.sd > 0] >= 0.999 * plain.sd[plain.sd > 0]).mean() > 0.9


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
        fit_head(head.rig, replace(spots, reading_deg=-2.5 * spots.reading_deg))


def test_no_spot_is_an_error() -> None:
    head, spots = spots_of(9)
    none = HeadSpots(
        spots.placements, spots.placement[:0], spots.reading_deg[:0], spots.position_px[:0], spots.sd_px[:0]
    )
    with pytest.raises(BadInputError, match="no spot is left to fit"):
        fit_head(head.rig, none)
