"""Nested models against their marginal likelihoods, and choices against simulated truth."""

from __future__ import annotations

from dataclasses import replace
from math import log

import numpy as np
import pytest
from scipy.stats import kstest

from tests.support.rigs import PROVENANCE, World, prior, thesis_rig
from workbench.calibration.estimation.fit import CalibrationFit, fit
from workbench.calibration.estimation.problem import LeastSquaresProblem
from workbench.calibration.model.term import Term
from workbench.calibration.selection import model_terms
from workbench.calibration.selection.model_terms import fit_chosen, without_idle
from workbench.calibration.verdict.export import calibrate
from workbench.model.acceptance import Acceptance
from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig
from workbench.sensor.calibrated import CalibratedSensor

SEEDS = (3, 4, 8)


def lens(rig: Rig, **priors: float) -> Rig:
    """The rig with other standard deviations of its lens terms."""
    camera = rig.camera.model_copy(update={name: prior(0.0, sd) for name, sd in priors.items()})
    return rig.model_copy(update={"camera": camera})


def chosen(rig: Rig, world: World, keep: tuple[str, ...] = ()) -> CalibrationFit:
    return fit_chosen(rig, world.observations(), keep=keep)


def told(fitted: CalibrationFit) -> dict[str, Term]:
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
def test_the_bayes_factor_is_the_ratio_of_marginal_likelihoods(name: str) -> None:
    rig = lens(thesis_rig(), k3=0.3)
    fitted = fit(rig, World(rig, 3).observations())
    index = model_terms._indices(fitted, [name])
    residual, jacobian, _ = linear(fitted)
    without = np.delete(jacobian, index, axis=1)
    expected = (log_likelihood(residual, jacobian) - log_likelihood(residual, without)) / log(10)
    assert model_terms._compare(fitted, index).log10_bayes_factor == pytest.approx(expected, abs=1e-4)


def test_what_is_carried_is_the_error_of_the_smaller_estimate() -> None:
    """Its gain applied to data whose k3 is as the prior says, against `_carried`."""
    rig = lens(thesis_rig(), k3=0.05)
    fitted = fit(rig, World(rig, 3).observations())
    index = model_terms._indices(fitted, ["k3"])
    _, jacobian, free = linear(fitted)
    free[index] = False
    within, of_k3 = jacobian[:, free], jacobian[:, index]
    gain = np.linalg.solve(within.T @ within + np.eye(free.sum()), within.T)
    # Rows: errors of the others and of k3; columns: what they come from, all of unit variance.
    by_others = np.concatenate([gain @ within - np.eye(free.sum()), np.zeros((1, free.sum()))])
    by_noise = np.concatenate([gain, np.zeros((1, len(jacobian)))])
    by_k3 = np.concatenate([gain @ of_k3, [[-1.0]]])
    expected = sum(part @ part.T for part in (by_others, by_noise, by_k3))
    carried = model_terms._carried(fitted, index, model_terms._compare(fitted, index).follow)
    order = np.concatenate([np.flatnonzero(free), index])
    sd = fitted.table.prior_sd[order]
    np.testing.assert_allclose(carried[np.ix_(order, order)] / np.outer(sd, sd), expected, atol=1e-6)


def test_p_values_of_an_absent_term_are_uniform() -> None:
    rig = lens(thesis_rig(), k3=0.3)
    worlds = [World(lens(rig, k3=0.0), seed) for seed in range(40)]
    p_values = []
    for world in worlds:
        fitted = fit(rig, [s for s in world.observations() if s.standoff_mm > 150])
        p_values.append(model_terms._compare(fitted, model_terms._indices(fitted, ["k3"])).p_value)
    assert kstest(p_values, "uniform").pvalue > 0.01


@pytest.mark.parametrize("seed", SEEDS)
def test_distortion_that_is_there_is_shown(seed: int) -> None:
    world = World(thesis_rig(), seed)
    world.values |= {"k1": -0.25, "k2": 0.3}
    fitted = chosen(thesis_rig(), world)
    assert told(fitted)["k2"].verdict == "shown"
    assert told(fitted)["k2"].p_value < 0.01
    assert told(fitted)["k1"].verdict in ("shown", "below")
    assert fitted.rig == thesis_rig()


@pytest.mark.parametrize("seed", SEEDS)
def test_tilts_that_are_not_there_are_left_out(seed: int) -> None:
    square = thesis_rig()
    world = World(
        square.model_copy(update={"bench": square.bench.model_copy(update={"tilt_sd_deg": 0.0})}), seed
    )
    fitted = chosen(thesis_rig(), world)
    assert told(fitted)["tilts"].verdict == "absent"
    tilts = [p.name.endswith(("slope_x", "slope_y")) for p in fitted.table.parameters]
    assert (fitted.sd[tilts] == 0).all()
    assert told(chosen(square, World(square, seed)))["tilts"].verdict == "shown"


@pytest.mark.parametrize("seed", SEEDS)
def test_a_k3_that_buys_nothing_is_left_out_and_stays_in_the_covariance(seed: int) -> None:
    rig = lens(thesis_rig(), k3=0.1)
    world = World(rig, seed)
    fitted = chosen(rig, world)
    term = told(fitted)["k3"]
    assert (term.verdict, abs(term.log10_bayes_factor) < 1) == ("idle", True)
    names = [p.name for p in fitted.table.parameters]
    k3 = names.index("k3")
    exported = without_idle(fitted)
    assert (exported.values[k3], exported.sd[k3]) == (0.0, pytest.approx(0.1))
    refitted = fit(lens(rig, k3=0.0), world.observations())
    free = refitted.sd > 0
    np.testing.assert_allclose((exported.values - refitted.values)[free] / refitted.sd[free], 0.0, atol=0.05)
    full = chosen(rig, world, keep=("k3",))
    assert told(full)["k3"].verdict == "asked for"
    np.testing.assert_array_equal(without_idle(full).values, full.values)
    others = np.flatnonzero((full.sd > 0) & (np.arange(len(names)) != k3))
    np.testing.assert_allclose(exported.sd[others], full.sd[others], rtol=0.03)
    # A fit that never knew of k3 claims too much.
    assert refitted.sd[names.index("k2")] < 0.9 * exported.sd[names.index("k2")]


@pytest.mark.parametrize("seed", SEEDS)
def test_a_term_that_the_rig_file_denies_is_called_for(seed: int) -> None:
    rig = lens(thesis_rig(), k2=0.0)
    world = World(thesis_rig(), seed)
    world.values |= {"k1": -0.2, "k2": 0.4}
    term = told(chosen(rig, world))["k2"]
    assert (term.verdict, term.range_shift_sd) == ("called for", None)
    assert term.p_value < 1e-3
    assert term.log10_bayes_factor > 0
    world.values |= {"k2": 0.0}
    assert "k2" not in told(chosen(rig, world))


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
    stated, _ = model_terms._effect_on_ranges(full, model_terms._indices(full, ["k2"]))
    assert stated == pytest.approx(np.concatenate(shifts).max(), rel=0.1)


@pytest.mark.parametrize("seed", [4, 6, 7])
def test_terms_that_can_replace_each_other_are_not_both_idle(seed: int) -> None:
    rig = lens(thesis_rig(), k1=0.3, k2=1.0, k3=3.0)
    world = World(thesis_rig(), seed)
    observations = [s for s in world.observations() if s.standoff_mm > 150]
    fitted = fit_chosen(rig, observations)
    idle = [t.name for t in fitted.terms if t.verdict == "idle"]
    assert idle
    shift, widening = model_terms._effect_on_ranges(fitted, model_terms._indices(fitted, idle))
    assert shift <= model_terms.IDLE_SHIFT_SD
    assert widening <= model_terms.IDLE_SD
    both = model_terms._indices(fitted, ["k2", "k3"])
    assert max(model_terms._effect_on_ranges(fitted, both)) > model_terms.IDLE_SD


@pytest.mark.parametrize("seed", SEEDS)
def test_spots_that_the_model_lacks_a_term_for_are_not_thrown_out(seed: int) -> None:
    rig = lens(thesis_rig(), k2=0.0)
    world = World(thesis_rig(), seed)
    world.values |= {"k1": -0.2, "k2": 0.4}
    fitted = chosen(rig, world)
    assert len(fitted.used) == len(world.observations())
    assert told(fitted)["k2"].p_value < 1e-6


def test_no_order_is_left_out_below_one_that_stays() -> None:
    world = World(thesis_rig(), 3)
    world.values |= {"k1": 0.0, "k2": 0.3}
    terms = told(chosen(thesis_rig(), world))
    assert terms["k2"].verdict == "shown"
    assert terms["k1"].verdict == "below"


@pytest.mark.parametrize("name", ["k4", "L1.tx", "p1"])
def test_a_term_to_keep_that_is_none_is_named(name: str) -> None:
    with pytest.raises(BadInputError, match=f"--keep {name}: expected a term .* k2, k1, ruler_scale, tilts"):
        chosen(thesis_rig(), World(thesis_rig(), 3), keep=(name,))


def test_a_smaller_model_is_fitted_to_the_captures_in_their_order() -> None:
    """What moved is found by the order of captures, those with a stray spot among them."""
    rig = thesis_rig()
    square = rig.model_copy(update={"bench": rig.bench.model_copy(update={"tilt_sd_deg": 0.0})})
    by_repeat = sorted(World(square, 3).observations(), key=lambda s: (s.standoff_mm, s.source[::-1]))
    observations = [replace(by_repeat[0], u_px=by_repeat[0].u_px + 3.0), *by_repeat[1:]]
    fitted = fit_chosen(rig, observations)
    assert told(fitted)["tilts"].verdict == "absent"
    assert [r.stray for r in fitted.rejected] == [observations[0]]
    assert fitted.cells.captures == tuple(observations)
