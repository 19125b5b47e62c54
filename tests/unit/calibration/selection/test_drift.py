"""Drift of the image: the test's estimate, its deviation, and the decision."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.support.rigs import World, thesis_rig
from workbench.calibration.data.observations import Observation
from workbench.calibration.estimation.fit import CalibrationFit, fit
from workbench.calibration.estimation.refit import optimum_of, problem_of
from workbench.calibration.model.parameters import fits_drift
from workbench.calibration.selection.drift import (
    SHOWN_P,
    DriftTest,
    drift_is_shown,
    drift_test,
    fit_with_drift,
    score_test,
    shift_columns,
)
from workbench.model.arrays import FloatArray
from workbench.procedure.engine.visiting_order import shuffled

RIG = thesis_rig(0.05, 0.048)


def drifting(seed: int, u_px: float, v_px: float = 0.0, *, ascending: bool = False) -> list[Observation]:
    """A session whose image shifts; in shuffled order, with two standoffs again at the end."""
    world = World(RIG, seed)
    first = world.observations(repeats=5)
    if not ascending:
        order = {standoff: n for n, standoff in enumerate(shuffled(tuple({s.standoff_mm for s in first})))}
        first = sorted(first, key=lambda s: order[s.standoff_mm])
        again = world.observations((1400.0, 3200.0), 5, session=2)
        first += [replace(s, placement=f"again {s.placement}") for s in again]
    time = np.linspace(-0.5, 0.5, len(first))
    return [
        replace(s, u_px=s.u_px + u_px * t, v_px=s.v_px + v_px * t) for s, t in zip(first, time, strict=True)
    ]


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("u_px", [0.0, 0.16, -0.3])
def test_the_estimate_lies_within_four_of_its_deviations(seed: int, u_px: float) -> None:
    found = drift_test(fit(RIG, drifting(seed, u_px, -u_px / 2)))
    assert np.all(np.abs(found.shift_px - [u_px, -u_px / 2]) < 4 * found.sd_px)
    assert np.all(found.sd_px < 0.08)


@pytest.mark.thorough
def test_p_values_are_even_without_a_drift() -> None:
    """12 sessions: not one below 0.003 (expected 0.04 sessions), and their median is ordinary."""
    p = [drift_test(fit(RIG, drifting(seed, 0.0))).p_value for seed in range(12)]
    assert min(p) > 0.003
    assert 0.2 < np.median(p) < 0.8


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_drift_is_fitted_where_the_order_shows_it(seed: int) -> None:
    found = fit_with_drift(RIG, drifting(seed, 0.25))
    assert fits_drift(found.rig)
    assert found.drift_px[0] == pytest.approx(0.25, abs=0.13)
    assert not drift_is_shown(found)


def test_ascending_standoffs_hide_most_of_a_drift() -> None:
    hidden = drift_test(fit(RIG, drifting(1, 0.0, ascending=True)))
    shown = drift_test(fit(RIG, drifting(1, 0.0)))
    assert hidden.sd_px[0] > 2.5 * shown.sd_px[0]


def test_a_session_without_a_drift_is_fitted_as_before() -> None:
    sound = drifting(1, 0.0)
    found = fit_with_drift(RIG, sound)
    assert not fits_drift(found.rig)
    assert found.drift_px.tolist() == [0.0, 0.0]
    np.testing.assert_array_equal(found.values, fit(RIG, sound).values)


def test_an_axis_known_only_in_combination_with_the_other_is_not_estimated() -> None:
    diagonal = np.array([1.0, 1.0]) / 2**0.5
    found = score_test(400.0 * np.outer(diagonal, diagonal), 80.0 * diagonal)
    assert found.shift_px.tolist() == [0.0, 0.0]
    assert np.isinf(found.sd_px).all()
    assert found.p_value == pytest.approx(6.3e-5, rel=0.02), (
        "a shift along the diagonal by 4 sd, one degree of freedom"
    )


def test_an_axis_without_information_does_not_hide_the_other() -> None:
    found = score_test(np.diag([400.0, 0.0]), np.array([80.0, 0.0]))
    np.testing.assert_allclose(found.shift_px, [0.2, 0.0])
    np.testing.assert_allclose(found.sd_px, [0.05, np.inf])


def interrupted(observations: list[Observation], *, pause_s: float = 3600.0) -> list[Observation]:
    """The session with times, interrupted after half of its captures."""
    half = len(observations) // 2
    return [
        replace(one, time_s=n + pause_s * (n >= half), part="1" if n >= half else "")
        for n, one in enumerate(observations)
    ]


@cache
def sound(*, parts: int) -> CalibrationFit:
    return fit(RIG, interrupted(drifting(1, 0.0)) if parts == 2 else drifting(1, 0.0))


def drawn_tests(fitted: CalibrationFit, shift_px: FloatArray, runs: int) -> list[DriftTest]:
    """Tests of simulated residuals: noise, parameters drawn from their priors, and shifts (K,)."""
    problem, random = problem_of(fitted), np.random.default_rng(5)
    _, jacobian = problem.linearise(optimum_of(fitted), fitted.noise_scale)
    columns = shift_columns(fitted)
    measured = np.asarray(problem.data.inverse_sd).ravel() > 0
    weight = np.linalg.inv(np.eye(len(jacobian)) + jacobian @ jacobian.T)
    information = columns.T @ weight @ columns
    found = []
    for _ in range(runs):
        noise = random.standard_normal(len(jacobian)) * measured
        seen = noise + jacobian @ random.standard_normal(jacobian.shape[1]) + columns @ shift_px
        found.append(score_test(information, columns.T @ weight @ seen))
    return found


@pytest.mark.long_cases
@pytest.mark.parametrize("parts", [1, 2])
def test_false_alarms_are_as_often_as_stated(parts: int) -> None:
    """Of 4000 at 0.3 and 5 %: 12 +- 3.5 and 200 +- 13.8; four standard deviations."""
    p = np.array([one.p_value for one in drawn_tests(sound(parts=parts), np.zeros(2 * parts), 4000)])
    assert abs((p < SHOWN_P).sum() - 12) < 14
    assert abs((p < 0.05).sum() - 200) < 55


def test_drift_and_step_are_unbiased_and_their_intervals_cover() -> None:
    """1000 interrupted sessions: means to 4 / sqrt(1000) sd, coverage of 95 % intervals to 4 of 0.7 %."""
    truth = np.array([0.2, -0.1, -0.15, 0.3])
    found = drawn_tests(sound(parts=2), truth, 1000)
    z = np.array([(one.shift_px - truth) / one.sd_px for one in found])
    assert np.abs(z.mean(axis=0)).max() < 4 / 1000**0.5
    assert np.abs((np.abs(z) < 1.96).mean(axis=0) - 0.95).max() < 0.028


def test_the_test_of_a_fit_is_that_of_its_residuals() -> None:
    """The score at the optimum and the covariance of the parameters, against the inverse of all data's."""
    fitted = sound(parts=2)
    residual, jacobian = problem_of(fitted).linearise(optimum_of(fitted), fitted.noise_scale)
    residual = residual - jacobian @ optimum_of(fitted)
    weight = np.linalg.inv(np.eye(len(jacobian)) + jacobian @ jacobian.T)
    columns = shift_columns(fitted)
    expected = score_test(columns.T @ weight @ columns, -columns.T @ weight @ residual)
    found = drift_test(fitted)
    np.testing.assert_allclose(found.shift_px, expected.shift_px, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(found.sd_px, expected.sd_px, rtol=1e-6)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_drift_that_begins_anew_after_an_interruption_is_fitted_with_its_step(seed: int) -> None:
    """The image shifts by 0.25 px in each half and jumps back while the session is interrupted."""
    still = interrupted(drifting(seed, 0.0))
    run = np.linspace(0.0, 0.5, len(still) // 2).tolist()
    run += np.linspace(0.0, 0.5, len(still) - len(run)).tolist()
    found = fit_with_drift(
        RIG, [replace(one, u_px=one.u_px + 0.5 * t) for one, t in zip(still, run, strict=True)]
    )
    assert found.layout.parts == 2
    drift = found.values[found.layout.drift][0]
    step = found.values[found.layout.steps][0]
    assert drift == pytest.approx(0.5, abs=0.25)
    assert step == pytest.approx(-0.25, abs=0.15)
    assert abs(found.drift_px[0]) == pytest.approx(0.25, abs=0.15), "the image is never farther from itself"
    assert not drift_is_shown(found)


def test_an_interruption_without_a_shift_changes_nothing() -> None:
    """The fit is that of the same session without times and parts, to the bit."""
    whole, halves = sound(parts=1), fit_with_drift(RIG, interrupted(drifting(1, 0.0)))
    assert not fits_drift(halves.rig)
    np.testing.assert_array_equal(halves.values, whole.values)
