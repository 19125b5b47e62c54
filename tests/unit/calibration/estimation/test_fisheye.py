"""A fisheye of 120 degrees through the normal fit: its parameters and ranges against made-up truths."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.board_world import BoardWorld
from tests.support.rigs import FISHEYE_STANDOFFS_MM, PROVENANCE, World, fisheye_rig, prior
from workbench.calibration.data.observations import Observation, as_grid
from workbench.calibration.estimation.batch import fit_batch
from workbench.calibration.estimation.fit import CalibrationFit, fit
from workbench.calibration.selection.model_terms import fit_calibration
from workbench.calibration.verdict.export import calibrate
from workbench.model.acceptance import Acceptance
from workbench.model.rig import Rig
from workbench.sensor.calibrated import CalibratedSensor

RANGES_MM = np.array([45.0, 100.0, 300.0, 1500.0])


def seen(seed: int, rig: Rig | None = None) -> tuple[list[Observation], World]:
    world = World(rig or fisheye_rig(), seed)
    return world.observations(FISHEYE_STANDOFFS_MM), world


@pytest.mark.thorough
def test_ranges_are_covered_as_stated() -> None:
    """24 sensors; the large run is `python -m tests.proofs.fisheye`."""
    distance2, count = 0.0, 0
    for seed in range(24):
        observations, world = seen(seed)
        fitted = fit(world.rig, observations)
        assert fitted.converged
        sensor = CalibratedSensor(calibrate(fitted, Acceptance(), PROVENANCE)[0])
        rng = np.random.default_rng([seed, 9])
        for laser in sensor.ids[::3]:
            shown = sensor.in_frame(laser, RANGES_MM)
            spots = np.array([world.pixel(laser, r + world.values["offset_mm"]) for r in RANGES_MM[shown]])
            noisy = spots + rng.normal(0.0, 0.05, spots.shape)
            found = sensor.ranges([laser] * len(noisy), noisy, np.full_like(noisy, 0.03))
            error = found.range_mm - RANGES_MM[shown]
            distance2 += float(error @ np.linalg.solve(found.covariance_mm2, error))
            count += len(error)
    # Chi-square; two lasers share a calibration, which at most doubles the variance: four deviations.
    assert distance2 / count == pytest.approx(1.0, abs=4 * np.sqrt(4 / count))


def test_one_by_one_is_as_many_at_once() -> None:
    observations, world = seen(3)
    single = fit(world.rig, observations)
    position, sd = as_grid(single.cells, 4)
    batch = fit_batch(world.rig, single.cells.placements, position[None], sd[None])
    free = single.table.prior_sd > 0
    off = (batch.values[0] - single.values)[free] / single.sd[free]
    np.testing.assert_allclose(off, 0.0, atol=1e-5)
    np.testing.assert_allclose(batch.sd[0][free], single.sd[free], rtol=1e-5)


def test_the_board_determines_a_fisheye_s_focal_length() -> None:
    def f(fitted: CalibrationFit) -> tuple[float, float]:
        return float(fitted.values[0]), float(fitted.sd[0])

    rig = fisheye_rig()
    world = World(rig, 2)
    near = [(120.0, 0.0, 0.0), (160.0, 0.0, 0.0), (140.0, 30.0, 0.0), (140.0, 0.0, -30.0)]
    observations, views = BoardWorld(world).measure(near)
    value, sd = f(fit(rig, observations, (), views))
    assert sd < 0.002 * value
    assert abs(value - world.values["f_px"]) < 4 * sd
    assert f(fit(rig, seen(2)[0]))[1] > 3 * sd


def test_a_coefficient_that_the_rig_file_holds_constant_is_called_for() -> None:
    rig = fisheye_rig()
    held = rig.model_copy(update={"camera": rig.camera.model_copy(update={"k1": prior(0.0, 0.0)})})
    world = World(rig, 1)
    world.values["k1"] = 0.08
    fitted = fit_calibration(held, world.observations(FISHEYE_STANDOFFS_MM))
    assert "k1" in [t.name for t in fitted.terms if t.verdict == "called for"]


def test_terms_go_from_the_highest_order_down() -> None:
    observations, world = seen(4)
    terms = [t.name for t in fit_calibration(world.rig, observations).terms]
    assert terms[:4] == ["k4", "k3", "k2", "k1"]
