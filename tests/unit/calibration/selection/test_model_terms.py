"""Nested models against their marginal likelihoods, and choices against simulated truth."""

from __future__ import annotations

from math import log

import numpy as np
import pytest
from scipy.stats import kstest

from tests.support.rigs import PROVENANCE, World, prior, thesis_rig
from workbench.calibration.estimation.fit import CalibrationFit, fit
from workbench.calibration.estimation.problem import LeastSquaresProblem
from workbench.calibration.selection import model_terms
from workbench.calibration.selection.model_terms import fit_calibration
from workbench.calibration.verdict.export import calibrate
from workbench.model.acceptance import Acceptance
from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.calibration import TermSummary
from workbench.model.rig import Rig
from workbench.sensor.calibrated import CalibratedSensor

SEEDS = (3, 4, 8)


def lens(rig: Rig, **priors: float) -> Rig:
    """The rig with other standard deviations of its lens terms."""
    camera = rig.camera.model_copy(update={name: prior(0.0, sd) for name, sd in priors.items()})
    return rig.model_copy(update={"camera": camera})


def weighed(rig: Rig, world: World) -> CalibrationFit:
    return fit_calibration(rig, world.observations())


def terms_of(fitted: CalibrationFit) -> dict[str, TermSummary]:
    return {term.name: term for term in fitted.terms}


def linear(fitted: CalibrationFit) -> tuple[FloatArray, FloatArray, BoolArray]:
    """At the priors' means: residuals (n,), derivatives (n, P) in priors' sd; which are free (P,)."""
    problem = LeastSquaresProblem.of(fitted.rig, fitted.table, fitted.cells, ())
    sd = fitted.table.prior_sd
    y = np.divide(fitted.values - fitted.table.prior_mean, sd, out=np.zeros_like(sd), where=sd > 0)
    residual, jacobian = problem.linearise(y, fitted.noise_scale)
    return residual - jacobian @ y, jacobian, sd > 0


def log_likelihood(residual: FloatArray, jacobian: FloatArray) -> float:
    """Marginal over parameters with unit priors and data with unit noise."""
    covariance = np.eye(len(residual)) + jacobian @ jacobian.T
    return float(-0.5 * (residual @ np.linalg.solve(covariance, residual) + np.linalg.slogdet(covariance)[1]))


@pytest.mark.parametrize("name", ["k2", "k3", "ruler_scale", "tilts"])
@pytest.mark.parametrize("mean", [0.0, 0.05])
def test_the_bayes_factor_is_the_ratio_of_marginal_likelihoods(name: str, mean: float) -> None:
    """Without the term its parameter is the mean of its prior."""
    rig = lens(thesis_rig(), k3=0.3)
    rig = rig.model_copy(update={"camera": rig.camera.model_copy(update={"k2": prior(mean, 0.3)})})
    fitted = fit(rig, World(rig, 3).observations())
    index = model_terms._indices(fitted, name)
    residual, jacobian, _ = linear(fitted)
    without = np.delete(jacobian, index, axis=1)
    expected = (log_likelihood(residual, jacobian) - log_likelihood(residual, without)) / log(10)
    assert model_terms._compare(fitted, index).log10_bayes_factor == pytest.approx(expected, abs=1e-4)


@pytest.mark.thorough
def test_p_values_of_an_absent_term_are_uniform() -> None:
    rig = lens(thesis_rig(), k3=0.3)
    worlds = [World(lens(rig, k3=0.0), seed) for seed in range(40)]
    p_values = []
    for world in worlds:
        fitted = fit(rig, [s for s in world.observations() if s.standoff_mm > 150])
        p_values.append(model_terms._compare(fitted, model_terms._indices(fitted, "k3")).p_value)
    assert kstest(p_values, "uniform").pvalue > 0.01


@pytest.mark.parametrize("seed", SEEDS)
def test_distortion_that_is_there_is_shown(seed: int) -> None:
    world = World(thesis_rig(), seed)
    world.values |= {"k1": -0.25, "k2": 0.3}
    fitted = weighed(thesis_rig(), world)
    assert terms_of(fitted)["k2"].verdict == "shown"
    assert terms_of(fitted)["k2"].p_value < 0.01
    assert terms_of(fitted)["k1"].range_shift_sd is not None
    assert fitted.rig == thesis_rig()


@pytest.mark.parametrize("seed", SEEDS)
def test_a_term_that_the_rig_file_denies_is_called_for(seed: int) -> None:
    rig = lens(thesis_rig(), k2=0.0)
    world = World(thesis_rig(), seed)
    world.values |= {"k1": -0.2, "k2": 0.4}
    term = terms_of(weighed(rig, world))["k2"]
    assert (term.verdict, term.range_shift_sd) == ("called for", None)
    assert term.p_value < 1e-3
    assert term.log10_bayes_factor > 0
    world.values |= {"k2": 0.0}
    assert "k2" not in terms_of(weighed(rig, world))


@pytest.mark.parametrize("seed", SEEDS)
def test_the_shift_of_a_range_is_that_of_two_fits(seed: int) -> None:
    """Ranged with and without k2, spots of the model with it; differences of the fits themselves."""
    world = World(thesis_rig(), seed)
    world.values |= {"k2": 0.1}  # small, so that first order is enough
    full = fit(thesis_rig(), world.observations())
    reduced = fit(lens(thesis_rig(), k2=0.0), world.observations())
    with_it, without = (CalibratedSensor(calibrate(f, Acceptance(), PROVENANCE)[0]) for f in (full, reduced))
    standoffs = np.geomspace(125.0, 4500.0, model_terms.GRID)
    shifts = []
    for laser in with_it.ids:
        seen = with_it.in_frame(laser, standoffs)
        spots = with_it.spot_px(laser, standoffs[seen])
        nothing = np.full(spots.shape, np.nan)
        one = with_it.ranges([laser] * len(spots), spots, nothing)
        other = without.ranges([laser] * len(spots), spots, nothing)
        shifts.append(np.abs(other.range_mm - one.range_mm) / one.sigma_mm)
    stated = terms_of(weighed(thesis_rig(), world))["k2"].range_shift_sd
    assert stated == pytest.approx(np.concatenate(shifts).max(), rel=0.1)


@pytest.mark.long_cases
@pytest.mark.parametrize("standoffs_mm", [(70.0, 125.0, 400.0, 2000.0), (125.0, 400.0, 2000.0)])
def test_ranges_whose_spots_lie_outside_the_image_do_not_count(standoffs_mm: tuple[float, ...]) -> None:
    fitted = fit(thesis_rig(), World(thesis_rig(), 3).observations(standoffs_mm))
    sensor = CalibratedSensor(calibrate(fitted, Acceptance(), PROVENANCE)[0])
    grid = np.geomspace(min(standoffs_mm), max(standoffs_mm), model_terms.GRID)
    seen = sum(int(sensor.in_frame(laser, grid).sum()) for laser in sensor.ids)
    gradient, own_sd = model_terms._range_gradients(fitted)
    assert len(gradient) == len(own_sd) == seen < len(sensor.ids) * len(grid)


@pytest.mark.parametrize("seed", SEEDS)
def test_spots_that_the_model_lacks_a_term_for_are_not_thrown_out(seed: int) -> None:
    rig = lens(thesis_rig(), k2=0.0)
    world = World(thesis_rig(), seed)
    world.values |= {"k1": -0.2, "k2": 0.4}
    fitted = weighed(rig, world)
    assert len(fitted.used) == len(world.observations())
    assert terms_of(fitted)["k2"].p_value < 1e-6


@pytest.mark.parametrize("seed", SEEDS)
def test_no_term_is_dropped_whatever_the_data_say(seed: int) -> None:
    """Square placements and no k3: the evidence speaks against tilts, and every parameter stays free."""
    rig = lens(thesis_rig(), k3=0.1)
    square = rig.model_copy(update={"bench": rig.bench.model_copy(update={"tilt_sd_deg": 0.0})})
    observations = World(lens(square, k3=0.0), seed).observations()
    fitted = fit_calibration(rig, observations)
    assert terms_of(fitted)["tilts"].verdict == "unneeded"
    assert terms_of(weighed(rig, World(rig, seed)))["tilts"].verdict == "shown"
    whole = fit(rig, observations)
    np.testing.assert_array_equal(fitted.values, whole.values)
    np.testing.assert_array_equal(fitted.covariance, whole.covariance)
    free = [p.name for p in fitted.table.parameters if p.prior.sd > 0]
    assert (fitted.sd[[p.prior.sd > 0 for p in fitted.table.parameters]] > 0).all()
    assert "k3" in free


@pytest.mark.parametrize("seed", SEEDS)
def test_a_term_that_the_data_cannot_decide_is_open(seed: int) -> None:
    rig = lens(thesis_rig(), k3=0.1)
    term = terms_of(weighed(rig, World(rig, seed)))["k3"]
    assert (term.verdict, abs(term.log10_bayes_factor) < 1) == ("open", True)
