"""Mistakes in all of the data together: columns exchanged, standoffs in another unit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.rigs import World, thesis_rig
from workbench.calibration.checks.faults import find_faults
from workbench.calibration.checks.hypotheses import explain_misfit
from workbench.calibration.checks.mistaken_data import UNITS, undecided_unit
from workbench.calibration.data.observations import Observation
from workbench.calibration.data.spot_rows import observations_of_rows
from workbench.calibration.estimation.fit import CalibrationFit, fit
from workbench.model.captures import load_captures
from workbench.model.rig import load_rig

ROOT = Path(__file__).parents[4]
RIG = thesis_rig()
SEEDS = (1, 2, 3)


def webcam_fit(unit_mm: float) -> CalibrationFit:
    """Fit of readings of one laser with wide priors, their standoffs in a unit."""
    rig = load_rig(ROOT / "rigs/webcam-laser.yaml")
    observations, rejected, boards = observations_of_rows(
        rig, load_captures(ROOT / "data/webcam-laser-rows.csv")
    )
    stated = [in_unit(s, unit_mm) for s in observations]
    return fit(rig, stated, rejected, boards)


def in_unit(s: Observation, unit_mm: float) -> Observation:
    return replace(s, standoff_mm=s.standoff_mm / unit_mm, placement=f"{s.standoff_mm / unit_mm:g} mm")


@pytest.mark.parametrize("seed", SEEDS)
def test_exchanged_columns_are_named_and_refused(seed: int) -> None:
    sound = World(RIG, seed).observations()
    fitted = fit(RIG, [replace(s, u_px=s.v_px, v_px=s.u_px) for s in sound])
    (found,) = explain_misfit(fitted)
    assert found.kind == "transposed"
    np.testing.assert_allclose(
        found.state.problem.data.position_px, fit(RIG, sound).cells.position_px, rtol=1e-9
    )
    (fault,) = find_faults(fitted, ())
    assert fault.name == "transposed"
    assert fault.refuses


@pytest.mark.long_cases
@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("seed", SEEDS)
def test_standoffs_in_another_unit_are_named(seed: int, unit: str) -> None:
    observations = World(RIG, seed).observations()
    fitted = fit(RIG, [in_unit(s, UNITS[unit]) for s in observations])
    assert [(h.kind, h.subject) for h in explain_misfit(fitted)] == [("unit", (list(UNITS).index(unit),))]


def test_centimetres_are_named_by_the_pull_of_wide_priors_alone() -> None:
    """One laser, the focal length known to 30 %, and residuals twice as large as stated."""
    fitted = webcam_fit(10.0)
    assert fitted.noise_scale > 1.5
    (fault,) = find_faults(fitted, ())
    assert fault.name == "unit"
    assert fault.refuses


def drawn_fit(f_px: float, y_mm: float, unit_mm: float) -> CalibrationFit:
    """Fit of a sensor that the wide priors allow, standoffs in a unit."""
    rig = load_rig(ROOT / "rigs/webcam-laser.yaml")
    rows = [
        row.model_copy(update={"v_px": round(239.5 + f_px * y_mm / row.standoff_mm)})
        for row in load_captures(ROOT / "data/webcam-laser-rows.csv")
        if 239.5 + f_px * y_mm / row.standoff_mm > 0
    ]
    observations, rejected, boards = observations_of_rows(rig, rows)
    return fit(rig, [in_unit(s, unit_mm) for s in observations], rejected, boards)


@pytest.mark.parametrize(("f_px", "y_mm"), [(695.0, -87.0), (898.0, -79.0)])
def test_a_unit_that_wide_priors_do_not_decide_is_possible(f_px: float, y_mm: float) -> None:
    fitted = drawn_fit(f_px, y_mm, 10.0)
    assert find_faults(fitted, ()) == ()
    assert undecided_unit(fitted) == "centimetres"
    assert undecided_unit(drawn_fit(f_px, y_mm, 1.0)) is None


@pytest.mark.parametrize(("f_px", "y_mm"), [(650.0, -50.0), (900.0, -75.0), (400.0, -30.0), (850.0, -30.0)])
def test_millimetres_of_likely_sensors_are_not_doubted(f_px: float, y_mm: float) -> None:
    assert undecided_unit(drawn_fit(f_px, y_mm, 1.0)) is None


def test_millimetres_need_no_other_unit() -> None:
    assert find_faults(webcam_fit(1.0), ()) == ()
