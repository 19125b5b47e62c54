"""Other accounts of the data: what a search finds, and what it saves by first order."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from tests.support.corrupted_data import exchanged, mirrored, shifted, stated_as, turned_at
from tests.support.rigs import World, thesis_rig
from workbench.calibration.checks import hypotheses, mistaken_data
from workbench.calibration.checks.cross_validation import rows_at
from workbench.calibration.checks.hypotheses import explain_misfit, is_improbable
from workbench.calibration.checks.hypothesis import Hypothesis
from workbench.calibration.data.observations import Observation
from workbench.calibration.estimation.fit import CalibrationFit, fit
from workbench.calibration.estimation.refit import Refit, measured, optimum_of, problem_of, refit
from workbench.calibration.selection.outliers import fit_without_outliers

RIG = thesis_rig()
SEEDS = (1, 2, 3)


def test_what_leaving_a_placement_out_gains_is_known_to_first_order() -> None:
    fit = fit_without_outliers(RIG, World(RIG, 3).observations())
    problem = problem_of(fit)
    state = refit(problem, measured(problem), optimum_of(fit))
    for index in range(len(fit.cells.placements)):
        rows = rows_at(problem, index)
        gain = state.cost - refit(problem, state.used & ~rows, np.zeros(len(state.y))).cost
        assert hypotheses._gain_without(state, rows) == pytest.approx(gain, rel=0.1)


@pytest.mark.parametrize(("standoff_mm", "off_mm"), [(900.0, 4.5), (900.0, 5.0), (1400.0, 12.0)])
def test_nothing_is_missed_where_no_refit_is_made(
    standoff_mm: float, off_mm: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    observations = stated_as(World(RIG, 20_001).observations(), standoff_mm, standoff_mm + off_mm)
    fit = fit_without_outliers(RIG, observations)
    quick = explain_misfit(fit)
    monkeypatch.setattr(hypotheses, "FIRST_ORDER_SHARE", 0.0)
    assert [(h.kind, h.subject) for h in quick] == [(h.kind, h.subject) for h in explain_misfit(fit)]


def kinds(observations: list[Observation]) -> list[tuple[str, tuple[int, ...]]]:
    return [(h.kind, h.subject) for h in explain_misfit(fit(RIG, observations))]


@pytest.mark.parametrize("seed", SEEDS)
def test_sound_data_need_no_other_account(seed: int) -> None:
    assert kinds(World(RIG, seed).observations()) == []


@pytest.mark.parametrize("seed", SEEDS)
def test_exchanged_lasers_are_the_only_account(seed: int) -> None:
    assert kinds(exchanged(World(RIG, seed).observations(), "L2", "L4")) == [("lasers_swapped", (1, 3))]


@pytest.mark.parametrize("seed", SEEDS)
def test_a_mirrored_picture_is_the_only_account(seed: int) -> None:
    world = World(RIG, seed)
    sound = world.observations()
    fitted = fit(RIG, mirrored(world, sound))
    (found,) = explain_misfit(fitted)
    assert (found.kind, found.subject) == ("mirrored", ())
    np.testing.assert_allclose(
        found.state.problem.data.position_px, fit(RIG, sound).cells.position_px, rtol=1e-9
    )


@pytest.mark.parametrize("account", [mistaken_data.flipped_images, mistaken_data.exchanged_lasers])
def test_an_account_costs_the_choice_among_its_alternatives(
    account: Callable[[CalibrationFit, Refit], Iterator[Hypothesis]],
) -> None:
    """Each is as likely as the others before the data: twice the logarithm of their number."""
    fitted = fit(RIG, World(RIG, 1).observations())
    problem = problem_of(fitted)
    state = refit(problem, measured(problem), optimum_of(fitted))
    found = list(account(fitted, state))
    assert len(found) in (3, 6)
    for h in found:
        noise = max(1.0, h.state.chi2 / h.state.freedom)
        assert h.score == pytest.approx((state.cost - h.state.cost) / noise - 2 * np.log(len(found)))
        assert not h.significant


def test_a_turned_target_is_the_only_account() -> None:
    fitted = fit(RIG, turned_at(World(RIG, 1), 280.0, 25.0))
    (found,) = explain_misfit(fitted)
    assert found.kind == "tilted"
    assert fitted.cells.placements[found.subject[0]].standoff_mm == 280.0


@pytest.mark.parametrize("seed", SEEDS)
def test_a_wrong_standoff_is_freed_to_where_the_target_stood(seed: int) -> None:
    fitted = fit(RIG, stated_as(World(RIG, seed).observations(), 600.0, 6000.0))
    (found,) = explain_misfit(fitted)
    assert found.kind == "standoff"
    (index,) = found.subject
    assert fitted.cells.placements[index].standoff_mm == 6000.0
    at_mm = float(np.asarray(found.state.problem.data.standoff_mm)[index])
    assert at_mm == pytest.approx(600.0, abs=5 * RIG.bench.placement_sd_mm + 0.005 * 600.0)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_wrong_standoff_is_found_in_noise_larger_than_stated(seed: int) -> None:
    """It explains nine tenths of the misfit, and the fit is improbable with it too."""
    louder = World(thesis_rig(noise_px=0.1, speckle_px=0.1), seed)
    (found,) = explain_misfit(fit(RIG, stated_as(louder.observations(), 600.0, 6000.0)))
    assert found.kind == "standoff"
    assert is_improbable(found.state)


@pytest.mark.parametrize(
    ("scale", "probable", "kept"), [(2.0, False, False), (5.0, False, True), (15.0, True, True)]
)
def test_what_leaves_the_data_improbable_must_explain_most(
    scale: float, probable: bool, kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Speckle twenty times what is stated; the only candidate lowers the cost as another noise would."""
    fitted = fit(thesis_rig(0.02, 0.008), World(thesis_rig(0.02, 0.16), 2).observations())
    problem = problem_of(fitted)
    before = refit(problem, measured(problem), optimum_of(fitted))
    after = before.at(scale)
    one = Hypothesis("standoff", (0,), after, 99.0, True)
    monkeypatch.setattr(hypotheses, "_candidates", lambda fit, state, first: iter([one] if first else []))
    excess = [state.cost - state.used.sum() for state in (before, after)]
    assert (excess[1] <= 0.1 * excess[0]) == kept
    assert is_improbable(after) != probable
    assert explain_misfit(fitted) == ((one,) if kept else ())


@pytest.mark.parametrize("seed", SEEDS)
def test_wrong_spots_are_left_out_and_the_rest_fits(seed: int) -> None:
    observations = shifted(World(RIG, seed).observations(), "L2", 600.0, 12.0)
    observations = shifted(observations, "L3", 210.0, -4.0)
    fitted = fit(RIG, observations)
    found = explain_misfit(fitted)
    spots = {
        (RIG.laser_ids[fitted.cells.laser[n]], fitted.cells.placements[fitted.cells.placement[n]].standoff_mm)
        for h in found
        for n in h.subject
    }
    assert {h.kind for h in found} == {"spot"}
    assert spots == {("L2", 600.0), ("L3", 210.0)}
    last = found[-1].state
    assert not is_improbable(last)
    for h in found:
        assert not last.used[2 * h.subject[0]]


@pytest.mark.parametrize("seed", SEEDS)
def test_a_spot_is_left_out_of_six_and_not_of_five(seed: int) -> None:
    rig = RIG.model_copy(update={"lasers": RIG.lasers[:3]})
    six = shifted(World(rig, seed).observations((300.0, 900.0)), "L2", 300.0, 12.0)
    five = [s for s in six if (s.laser_id, s.standoff_mm) != ("L3", 900.0)]
    assert [h.kind for h in explain_misfit(fit(rig, six))] == ["spot"]
    assert "spot" not in [h.kind for h in explain_misfit(fit(rig, five))]


def test_a_fit_far_worse_than_its_noise_is_improbable() -> None:
    fitted = fit(RIG, World(RIG, 1).observations())
    problem = problem_of(fitted)
    state = refit(problem, measured(problem), optimum_of(fitted))
    assert not is_improbable(state)
    assert is_improbable(state.at(0.5))


def test_a_wrong_spot_costs_the_choice_among_all_positions_in_the_image() -> None:
    """Twice the logarithm of the image's area over that of a spot's deviations, to odds of five to one."""
    places = RIG.camera.width_px * RIG.camera.height_px / RIG.noise.spot_sd_px**2
    assert pytest.approx(2 * np.log(places), abs=2 * np.log(5)) == hypotheses.SPOT_COST
