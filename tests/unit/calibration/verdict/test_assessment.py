"""The verdict on a fit: limits, faults, and what makes it accepted or refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.support.message_text import laser_ids, numbers
from tests.support.rigs import STANDOFFS_MM, World, prior, thesis_rig
from workbench.calibration.checks.cross_validation import leave_each_out
from workbench.calibration.checks.priors import CONTRADICTION_SD, doubted_priors
from workbench.calibration.estimation.fit import CalibrationFit, fit
from workbench.calibration.selection.drift import with_drift
from workbench.calibration.verdict.assessment import (
    Assessment,
    _missed_limits,
    assess,
    basis,
    derive,
)
from workbench.model.acceptance import Acceptance
from workbench.procedure.engine.visiting_order import shuffled


@pytest.fixture(scope="module")
def fitted() -> CalibrationFit:
    return fit(thesis_rig(), World(thesis_rig(), 1).observations())


def judged(fitted: CalibrationFit, worst: float = 0.01, **limits: float) -> Assessment:
    return assess(fitted, Acceptance.model_validate(limits), worst, leave_each_out(fitted))


def test_limits_that_fail_are_named(fitted: CalibrationFit) -> None:
    (rms,) = judged(fitted, max_rms_px=0.001).reasons
    assert numbers(rms)[:2] == [pytest.approx(fitted.rms_px, abs=0.005), 0.001]
    (relative,) = judged(fitted, worst=0.3).reasons
    assert numbers(relative)[:2] == [30.0, 5.0]
    few = judged(fitted, min_standoffs=12).reasons
    assert [laser_ids(reason) for reason in few] == [["L1"], ["L2"], ["L3"], ["L4"]]
    assert [numbers(reason) for reason in few[1:3]] == [[11.0, 12.0]] * 2
    assert judged(fitted, worst=float("nan")).verdict == "refused"


def test_further_standoffs_are_the_remedy_of_large_uncertainty_and_of_few_standoffs_alone(
    fitted: CalibrationFit,
) -> None:
    assert judged(fitted, worst=0.3).needs_standoffs
    assert judged(fitted, min_standoffs=12).needs_standoffs
    assert not judged(fitted, max_rms_px=0.001).needs_standoffs
    assert not judged(fitted).needs_standoffs


@pytest.mark.parametrize(("cell", "axis"), [(3, 0), (17, 1)])
def test_the_largest_residual_is_that_of_most_standard_deviations(
    fitted: CalibrationFit, cell: int, axis: int
) -> None:
    """0.2 px at 0.01 px, beside 0.9 px at 1 px."""
    residual, sd = np.full_like(fitted.residual_px, 0.9), np.ones_like(fitted.residual_px)
    residual[cell, axis], sd[cell, axis] = -0.2, 0.01
    changed = replace(fitted, residual_px=residual, cells=replace(fitted.cells, sd_px=sd), rms_px=1.0)
    (reason,) = _missed_limits(changed, Acceptance.model_validate({"max_rms_px": 0.5}), 0.01)
    laser_id = fitted.rig.laser_ids[fitted.cells.laser[cell]]
    standoff_mm = fitted.cells.placements[fitted.cells.placement[cell]].standoff_mm
    assert laser_ids(reason) == [laser_id]
    assert -0.2 in numbers(reason)
    assert standoff_mm in numbers(reason)
    assert f"in {'uv'[axis]} of" in reason


def test_a_sound_fit_has_no_warning_of_scatter(fitted: CalibrationFit) -> None:
    assert fitted.cells.repeat_scale == fitted.noise_scale == 1.0
    assert not [text for text in judged(fitted).warnings if "scatter" in text or "residuals" in text]


def test_repeats_that_scatter_more_than_stated_are_a_warning() -> None:
    rig = thesis_rig()
    louder = thesis_rig(noise_px=3 * rig.noise.spot_sd_px)
    found = fit(rig, World(louder, 1).observations(repeats=10))
    assert found.cells.repeat_scale > 2
    (line,) = [text for text in judged(found).warnings if "repeats scatter" in text]
    assert numbers(line)[0] == pytest.approx(found.cells.repeat_scale, abs=0.006)


def test_a_laser_that_never_lit_is_named() -> None:
    rig = thesis_rig()
    observations = [s for s in World(rig, 1).observations(repeats=1) if s.laser_id != "L2"]
    found = judged(fit(rig, observations))
    assert [fault.name for fault in found.faults] == ["never_lit"]
    assert found.reasons == (found.faults[0].message,)
    assert laser_ids(found.reasons[0]) == ["L2"]


@pytest.mark.parametrize(
    ("share", "sd", "prior_sd", "rests_on"),
    [
        (0.9, 1.0, 1.0, "data"),
        (0.89, 0.91, 1.0, "prior"),
        (0.89, 0.89, 1.0, "joint"),
        (0.0, 0.0, 0.0, "prior"),
    ],
)
def test_a_parameter_rests_on_data_prior_or_both(
    share: float, sd: float, prior_sd: float, rests_on: str
) -> None:
    assert basis(share, sd, prior_sd) == rests_on


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_derived_quantities_carry_the_whole_covariance(seed: int) -> None:
    """f b and the vanishing point against draws from the posterior, projected by OpenCV's lens."""
    world = World(thesis_rig(), seed)
    result = fit(world.rig, world.observations())
    names = [p.name for p in result.table.parameters][result.sensor]
    draws = np.random.default_rng(seed).multivariate_normal(
        result.values[result.sensor], result.covariance[result.sensor, result.sensor], 1000, method="eigh"
    )
    for one in derive(result):
        products, vanishing = [], []
        for values in draws:
            world.values = dict(zip(names, values, strict=True))
            own = [world.values[f"{one.laser_id}.{name}"] for name in ("x_mm", "y_mm", "tx", "ty")]
            products.append(world.values["f_px"] * np.hypot(own[0], own[1]))
            vanishing.append(world.pixels(np.array([[*own[2:], 1.0]]))[0, 0])
        # 1000 draws know a deviation to 2.2 %, a mean to 3.2 % of it.
        assert one.f_b_sd == pytest.approx(np.std(products), rel=0.09)
        assert one.f_b_px_mm == pytest.approx(np.mean(products), abs=0.13 * one.f_b_sd)
        assert one.infinity_sd == pytest.approx(np.std(vanishing), rel=0.09)
        assert one.infinity_px == pytest.approx(np.mean(vanishing), abs=0.13 * one.infinity_sd)


def test_a_prior_that_the_data_contradict_refuses() -> None:
    """An offset of 40 mm where the rig file says 0 +- 5 mm, and where it says 0 +- 40 mm."""
    rig = thesis_rig()
    world = World(rig, 1)
    world.values["offset_mm"] = 40.0
    observations = world.observations()
    bench = rig.bench.model_copy(update={"offset_mm": prior(0.0, 40.0)})
    narrow, wide = fit(rig, observations), fit(rig.model_copy(update={"bench": bench}), observations)
    index = [p.name for p in narrow.table.parameters].index("offset_mm")
    assert abs(narrow.prior_pull[index]) > CONTRADICTION_SD > abs(wide.prior_pull[index])
    assert (judged(narrow).verdict, judged(wide).verdict) == ("refused", "accepted")


def test_a_solver_that_did_not_converge_is_a_reason() -> None:
    result = fit(thesis_rig(), World(thesis_rig(), 1).observations())
    found = judged(replace(result, converged=False))
    assert found.verdict == "refused"
    assert len(found.reasons) == 1


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_fitted_drift_is_judged_by_its_limit_not_by_its_prior(seed: int) -> None:
    """A drift of 2.8 px, more than 5 deviations of the prior that the fit gives it."""
    rig = thesis_rig()
    order = shuffled(STANDOFFS_MM)
    sound = sorted(World(rig, seed).observations(), key=lambda s: order.index(s.standoff_mm))
    time = np.linspace(-0.5, 0.5, len(sound))
    drifted = [replace(s, u_px=s.u_px + 2.8 * t) for s, t in zip(sound, time, strict=True)]
    found = fit(with_drift(rig), drifted)
    assert found.drift_px[0] == pytest.approx(2.8, abs=0.5)
    assert doubted_priors(found) == []
    assert len(judged(found).reasons) == 1


def test_placements_that_scatter_more_than_stated_are_a_warning_and_a_limit() -> None:
    rig = thesis_rig()
    loose = rig.model_copy(update={"bench": rig.bench.model_copy(update={"placement_sd_mm": 1.5})})
    found = fit(rig, World(loose, 3).observations())
    assert found.placement_scale > 2
    (line,) = [text for text in judged(found).warnings if "placements scatter" in text]
    assert numbers(line)[0] == pytest.approx(found.placement_scale, abs=0.06)
    assert judged(found, max_placement_scale=1.5).verdict == "refused"


def test_a_missing_speckle_is_named_where_the_residuals_call_for_it() -> None:
    rig = thesis_rig(0.02, 0.06)
    silent = rig.model_copy(update={"noise": rig.noise.model_copy(update={"speckle_sd_px": 0.0})})
    missing = judged(fit(silent, World(rig, 1).observations(repeats=10)))
    assert any("noise.speckle_sd_px" in text for text in missing.warnings)
    stated = judged(fit(rig, World(rig, 1).observations(repeats=10)))
    assert not any("noise.speckle_sd_px" in text for text in stated.warnings)
