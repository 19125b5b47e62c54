"""The least-squares problem: its derivatives against differences, and its solution."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.support.board_world import PLACINGS, BoardWorld
from tests.support.rigs import World, board_rig, fisheye_rig, thesis_rig
from workbench.calibration.estimation.fit import fit
from workbench.calibration.estimation.problem import LeastSquaresProblem
from workbench.calibration.estimation.refit import optimum_of, problem_of
from workbench.model.rig import Rig

RIG = thesis_rig()


def test_what_a_standoff_moves_is_its_difference() -> None:
    problem, y = (
        problem_of(fit(RIG, World(RIG, 1).observations())),
        optimum_of(fit(RIG, World(RIG, 1).observations())),
    )
    step_mm = 1e-3
    ahead, behind = (
        LeastSquaresProblem(
            problem.layout,
            problem.data._replace(standoff_mm=np.asarray(problem.data.standoff_mm) + sign * step_mm),
        ).linearise(y, 2.0)[0]
        for sign in (1, -1)
    )
    np.testing.assert_allclose(
        problem.by_standoff(y, 2.0), (ahead - behind) / (2 * step_mm), rtol=1e-6, atol=1e-8
    )


@pytest.mark.long_cases
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("rig", [RIG, fisheye_rig()], ids=["plumb_bob", "equidistant"])
def test_the_jacobian_is_the_difference_of_residuals(rig: Rig, seed: int) -> None:
    standoffs = (60.0, 230.0, 1000.0) if rig.camera.lens == "equidistant" else (160.0, 400.0, 1400.0)
    problem = problem_of(fit(rig, World(rig, seed).observations(standoffs, repeats=1)))
    y = np.random.default_rng(seed).normal(0.0, 0.3, len(np.asarray(problem.data.mean)))
    _, jacobian = problem.linearise(y, 1.5)
    for k in range(len(y)):
        step = np.zeros(len(y))
        step[k] = 1e-5
        ahead, behind = problem.linearise(y + step, 1.5)[0], problem.linearise(y - step, 1.5)[0]
        np.testing.assert_allclose(jacobian[:, k], (ahead - behind) / 2e-5, rtol=1e-5, atol=1e-5)


def test_the_board_s_corners_are_rows_after_the_spots_with_their_own_derivatives() -> None:
    world = World(board_rig(), 1)
    observations, views = BoardWorld(world).measure(PLACINGS[:2])
    found = fit(world.rig, observations, (), views)
    problem = problem_of(found)
    y = optimum_of(found)
    residual, jacobian = problem.linearise(y)
    spots, corners = found.cells.position_px, found.corner_residual_px
    assert len(residual) == 2 * (len(spots) + len(corners))
    inverse_sd = np.asarray(problem.data.inverse_sd)
    pixels = -residual.reshape(-1, 2) / np.where(inverse_sd > 0, inverse_sd, np.nan)
    np.testing.assert_allclose(pixels[len(spots) :], corners, atol=1e-6)
    for k in range(problem.layout.print_scale.start, len(y), 7):
        step = np.zeros(len(y))
        step[k] = 1e-6
        ahead, behind = problem.linearise(y + step)[0], problem.linearise(y - step)[0]
        np.testing.assert_allclose(jacobian[:, k], (ahead - behind) / 2e-6, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("seed", [1, 2])
def test_at_the_solution_the_gradient_vanishes_and_the_covariance_is_the_curvature_s(seed: int) -> None:
    problem = problem_of(fit(RIG, World(RIG, seed).observations(repeats=1)))
    found = problem.solve(2.0)
    residual, jacobian = problem.linearise(found.y, 2.0)
    assert found.converged
    gradient = jacobian.T @ residual + found.y
    assert np.abs(gradient @ np.linalg.cholesky(found.covariance)).max() < 1e-4
    factor = np.linalg.cholesky(jacobian.T @ jacobian + np.eye(len(found.y)))
    np.testing.assert_allclose(factor.T @ found.covariance @ factor, np.eye(len(found.y)), atol=1e-6)
    assert found.chi2 == pytest.approx(4.0 * residual @ residual, rel=1e-6)


def test_what_was_not_measured_has_no_residual_and_counts_for_nothing() -> None:
    observations = World(RIG, 1).observations(repeats=1)
    blind = [replace(s, v_px=float("nan")) if s.laser_id == "L2" else s for s in observations]
    found = fit(RIG, blind)
    problem = problem_of(found)
    solution = problem.solve(1.0)
    unmeasured = found.cells.laser == RIG.laser_ids.index("L2")
    np.testing.assert_array_equal(np.isnan(solution.residual_px[:, 1]), unmeasured)
    assert np.isfinite(solution.residual_px[:, 0]).all()
    residual, jacobian = problem.linearise(solution.y)
    of_v = 2 * np.flatnonzero(unmeasured) + 1
    assert not residual[of_v].any()
    assert not jacobian[of_v].any()


def test_spots_ask_for_the_noise_that_they_show() -> None:
    louder = World(thesis_rig(0.12, 0.16), 1).observations()
    problem = problem_of(fit(thesis_rig(0.12, 0.04), louder))
    found = problem.solve(1.0)
    expected = np.sqrt(found.chi2 / found.degrees_of_freedom)
    assert found.significant_scale == pytest.approx(expected)
    assert found.significant_scale > 1.5
