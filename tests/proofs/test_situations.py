"""Situations: the bound on what a test can name, and the table."""

from __future__ import annotations

import numpy as np
import pytest

from tests.proofs.situations import SITUATIONS, Row, Situation, best_power, lines, run
from tests.support.rigs import World, thesis_rig
from workbench.calibration.checks.priors import DOUBT_P
from workbench.calibration.estimation.fit import CalibrationFit, fit


@pytest.fixture(scope="module")
def world() -> World:
    return World(thesis_rig(), 3)


@pytest.fixture(scope="module")
def fitted(world: World) -> CalibrationFit:
    return fit(world.rig, world.observations())


def power(fitted: CalibrationFit, name: str, offset_sd: float) -> float:
    """Of a parameter whose truth lies so far from its prior's mean."""
    index = [p.name for p in fitted.table.parameters].index(name)
    world = World(fitted.rig, 3)
    world.values[name] = float(fitted.table.prior_mean[index] + offset_sd * fitted.table.prior_sd[index])
    return best_power(fitted, world, (name,))


def test_the_best_test_of_a_right_statement_has_its_false_alarms_alone(fitted: CalibrationFit) -> None:
    assert power(fitted, "ruler_scale", 0.0) == pytest.approx(DOUBT_P)
    assert power(fitted, "cx_px", 0.0) == pytest.approx(DOUBT_P)


def test_what_the_data_determine_is_named_and_what_they_do_not_is_not(fitted: CalibrationFit) -> None:
    """The image centre's prior is 40 times wider than its posterior; the ruler's scale is its statement."""
    assert power(fitted, "cx_px", 5.0) > 0.95
    assert power(fitted, "ruler_scale", 5.0) < 0.05


def test_power_is_that_of_the_optimal_statistic_in_simulated_data(fitted: CalibrationFit) -> None:
    """For one parameter y ~ N((1 - c) d, 1 - c): the share beyond the threshold of `DOUBT_P` at d = 0."""
    index = [p.name for p in fitted.table.parameters].index("target_slope_x")
    c = float(fitted.covariance[index, index] / fitted.table.prior_sd[index] ** 2)
    draws = np.random.default_rng(7).normal(0.0, (1 - c) ** 0.5, 400_000)
    threshold = np.quantile(draws, 1 - DOUBT_P)
    share = float((draws + (1 - c) * 4.0 > threshold).mean())
    assert power(fitted, "target_slope_x", 4.0) == pytest.approx(share, abs=0.01)


def test_a_constant_parameter_is_judged_by_the_information_on_it(
    world: World, fitted: CalibrationFit
) -> None:
    powers = []
    for p2 in (0.0003, 0.003, 0.03):
        world.values["p2"] = p2
        powers.append(best_power(fitted, world, ("p2",)))
    assert powers == sorted(powers)
    assert powers[0] < 2 * DOUBT_P
    assert powers[-1] > 0.9


def test_without_a_wrong_statement_nothing_bounds_the_test(world: World, fitted: CalibrationFit) -> None:
    assert best_power(fitted, world, ()) == 1.0


def test_a_row_is_simulated_and_printed() -> None:
    by_name = {situation.name: situation for situation in SITUATIONS}
    turned: Situation = by_name["target turned by 6 deg at 280 mm"]
    row = run(turned, 2)
    assert (row.accepted, row.named, row.verdict) == (0.0, 1.0, "")
    *_, line = lines([row])
    assert line.startswith(turned.name)


@pytest.mark.parametrize(("best", "verdict"), [(1.0, "MISSED"), (0.4, "unseen")])
def test_a_row_that_is_neither_covered_nor_named_is_marked(best: float, verdict: str) -> None:
    row = Row("r", 200, 1.0, 0.8, 0.7, 0.1, 0.8, 180, best, base=False)
    assert row.verdict.strip() == verdict
