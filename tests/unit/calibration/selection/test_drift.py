"""Drift of the image: the test's estimate, its deviation, and the decision."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.support.rigs import World, thesis_rig
from workbench.calibration.data.observations import Observation
from workbench.calibration.estimation.fit import fit
from workbench.calibration.model.parameters import fits_drift
from workbench.calibration.selection.drift import (
    drift_is_shown,
    drift_test,
    fit_with_drift,
    score_test,
)
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
