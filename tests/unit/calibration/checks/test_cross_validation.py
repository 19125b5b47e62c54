"""Leave-one-standoff-out: against refits, against simulated truth, and what it says of a wrong standoff."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.corrupted_data import stated_as
from tests.support.message_text import numbers
from tests.support.rigs import STANDOFFS_MM, World, thesis_rig
from workbench.calibration.checks.cross_validation import alarms, leave_each_out
from workbench.calibration.data.observations import Observation
from workbench.calibration.data.spot_rows import observations_of_rows
from workbench.calibration.estimation.fit import fit
from workbench.calibration.verdict.assessment import assess
from workbench.model.acceptance import Acceptance
from workbench.model.captures import load_captures
from workbench.model.fit_event import CrossValidatedPlacement
from workbench.model.rig import Rig, load_rig

ROOT = Path(__file__).parents[4]
RIG = thesis_rig()
SEEDS = (1, 2, 3)
FITS = 40


@pytest.fixture(scope="module")
def sound() -> list[tuple[CrossValidatedPlacement, ...]]:
    """The folds of simulated calibrations in which nothing is wrong."""
    return [leave_each_out(fit(RIG, World(RIG, seed).observations())) for seed in range(500, 500 + FITS)]


@pytest.mark.parametrize("seed", SEEDS)
def test_range_errors_are_those_of_a_fit_whose_standoff_is_free(seed: int) -> None:
    """A placement whose ruler may be a metre off: what its error is fitted to, is what its spots range."""
    observations = World(RIG, seed).observations()
    folds = {fold.standoff_mm: fold for fold in leave_each_out(fit(RIG, observations))}
    for standoff in (160.0, 600.0, 3200.0):
        told = [replace(s, standoff_sd_mm=1e3) if s.standoff_mm == standoff else s for s in observations]
        freed = fit(RIG, told)
        index = [p.name for p in freed.table.parameters].index(f"{standoff:g}.error_mm")
        sd = np.hypot(freed.sd[index], RIG.bench.placement_sd_mm)
        assert folds[standoff].sd_mm == pytest.approx(sd, rel=0.01)
        assert folds[standoff].error_mm == pytest.approx(freed.values[index], abs=0.02 * sd)


def test_errors_are_as_large_as_promised(sound: list[tuple[CrossValidatedPlacement, ...]]) -> None:
    folds = [fold for folds in sound for fold in folds]
    z2 = np.array([fold.z**2 for fold in folds])
    by_laser = np.array([((i.error_mm or 0.0) / i.sd_mm) ** 2 for fold in folds for i in fold.lasers])
    chi2 = np.array([fold.chi2 / fold.coordinates for fold in folds])
    # Each fit counts once: its folds, and the lasers of a placement, share errors.
    for square in (z2, chi2, by_laser):
        assert square.mean() == pytest.approx(1.0, abs=4 * np.sqrt(2 / len(folds)))
    assert {fold.coordinates for fold in folds} <= {4, 6, 8}


def test_chances_are_chances(sound: list[tuple[CrossValidatedPlacement, ...]]) -> None:
    """A tenth of all chances lie below 0.1."""
    for name in ("range_p", "spots_p"):
        chances = np.array([getattr(fold, name) for folds in sound for fold in folds])
        assert (chances < 0.1).mean() == pytest.approx(0.1, abs=4 * np.sqrt(0.09 / len(chances)))


def test_sound_calibrations_raise_no_alarm(sound: list[tuple[CrossValidatedPlacement, ...]]) -> None:
    """One in 1000 does: that one of 40 would is a chance of 4 %, and the seeds are fixed."""
    assert not any(alarms(folds) for folds in sound)


@pytest.mark.parametrize("standoff_mm", STANDOFFS_MM[:7])
@pytest.mark.parametrize("seed", SEEDS)
def test_ten_millimetres_are_found_up_to_900(seed: int, standoff_mm: float) -> None:
    result = fit(RIG, stated_as(World(RIG, seed).observations(), standoff_mm, standoff_mm + 10))
    found = alarms(leave_each_out(result))
    worst = min(found, key=lambda fold: min(fold.range_p, fold.spots_p))
    assert worst.standoff_mm == standoff_mm + 10
    # The ruler says 10 mm more than the spots do.
    assert worst.error_mm == pytest.approx(-10.0, abs=4 * worst.sd_mm)


def test_an_alarm_refuses_and_says_what_to_do() -> None:
    """12 mm at 1400: seen, though not so clearly that it could have no other name."""
    fitted = fit(RIG, stated_as(World(RIG, 5).observations(), 1400.0, 1412.0))
    assessment = assess(fitted, Acceptance(), 0.01, leave_each_out(fitted))
    assert (assessment.verdict, assessment.faults) == ("refused", ())
    (reason,) = assessment.reasons
    (alarm,) = alarms(assessment.cross_validation)
    standoff_mm, error_mm, *_ = numbers(reason)
    assert standoff_mm == alarm.standoff_mm == 1412.0
    assert error_mm == pytest.approx(alarm.error_mm, abs=0.005)


def test_an_error_of_a_third_is_the_range_by_the_fit_without_it() -> None:
    """Integer rows in v; in the range, the error to first order would be a quarter too small."""
    camera = {"width_px": 320, "height_px": 240, "f_px": {"value": 300.0, "sd": 90.0}}
    laser = {"id": "1", "axis": "v", "x_mm": {"value": 0.0, "sd": 0.0}, "y_mm": {"value": -22.5, "sd": 1.0}}
    rig = Rig.model_validate(
        {
            "format": 1,
            "rig": "rows",
            "camera": camera | {"cx_px": {"value": 159.5, "sd": 20.0}, "cy_px": {"value": 119.5, "sd": 20.0}},
            "lasers": [laser | {"ty": {"value": 0.0, "sd": 0.1}}],
            "bench": {"offset_mm": {"value": 0.0, "sd": 0.0}},
            "noise": {"spot_sd_px": 0.289},
        }
    )
    rows = {180.0: 81.0, 350.0: 99.0, 400.0: 101.0, 650.0: 108.0, 2450.0: 116.0}
    observations = [Observation(f"{mm:g}", "1", f"{mm:g}", mm, 0, np.nan, v) for mm, v in rows.items()]
    far = leave_each_out(fit(rig, observations))[-1]
    freed = fit(rig, [*observations[:-1], replace(observations[-1], standoff_sd_mm=1e5)])
    index = [p.name for p in freed.table.parameters].index("2450.error_mm")
    assert far.error_mm == pytest.approx(freed.values[index], rel=0.02)
    assert far.error_mm is not None
    assert far.error_mm > 1.3 * far.z * far.sd_mm
    assert far.lasers[0].error_mm == pytest.approx(far.error_mm, rel=0.02)


def test_spots_beyond_infinity_have_no_range() -> None:
    world = World(RIG, 1)
    observations = [
        replace(s, u_px=2 * float(world.pixel(s.laser_id, 1e9)[0]) - s.u_px) if s.standoff_mm == 4500 else s
        for s in world.observations()
    ]
    far = leave_each_out(fit(RIG, observations))[-1]
    assert far.error_mm is None
    assert {laser.error_mm for laser in far.lasers} == {None}
    assert far.alarm
    assert far.z > 0
    assert far.relative_error > 1


def test_two_placements_leave_nothing_to_predict_with() -> None:
    assert leave_each_out(fit(RIG, World(RIG, 1).observations((200.0, 800.0)))) == ()


def test_noise_that_nobody_stated_rightly_is_no_alarm() -> None:
    """Real readings, scattering 2.4 times as much as their rounding: the noise is then the others'."""
    rig = load_rig(ROOT / "rigs/webcam-laser.yaml")
    folds = leave_each_out(
        fit(rig, *observations_of_rows(rig, load_captures(ROOT / "data/webcam-laser-rows.csv")))
    )
    assert all(fold.freedom is not None for fold in folds)
    assert not alarms(folds)
