"""Advice during a procedure: against the fit of the same captures."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.rigs import PROVENANCE, STANDOFFS_MM, World
from workbench.calibration.design.expectation import Expectation
from workbench.calibration.design.next_standoff import advise
from workbench.calibration.design.standoffs import (
    RangeGoals,
)
from workbench.calibration.estimation.fit import CalibrationFit, fit
from workbench.calibration.verdict.export import calibrate
from workbench.model.acceptance import Acceptance
from workbench.model.rig import load_rig
from workbench.procedure.engine.procedure_file import load_procedure
from workbench.steps.capture_grid import CaptureGridStep

ROOT = Path(__file__).parents[4]
RIG = load_rig(ROOT / "rigs/thesis-emulated.yaml")
SHIPPED = STANDOFFS_MM


class TestAdvice:
    """During a procedure."""

    def test_it_ends_at_what_the_fit_states(self) -> None:
        world = World(RIG, 3)
        observations = world.observations(SHIPPED, 10)
        advice = advise(RIG, observations, SHIPPED)
        assert advice is not None
        calibration, _ = calibrate(fit(RIG, observations), Acceptance(), PROVENANCE)
        stated = calibration.laser_ranger.validity.max_relative_range_sd
        assert advice.relative_range_sd == pytest.approx(stated, rel=0.01)
        assert advice.placements == len(SHIPPED)

    def test_a_placement_where_it_says_gains_what_it_says(self) -> None:
        world = World(RIG, 3)
        before = advise(RIG, world.observations(SHIPPED[:3], 10), SHIPPED)
        assert before is not None
        assert before.then_relative_range_sd < 0.3 * before.relative_range_sd
        further = (*SHIPPED[:3], before.next_standoff_mm)
        after = advise(RIG, world.observations(further, 10), SHIPPED)
        assert after is not None
        assert after.relative_range_sd == pytest.approx(before.then_relative_range_sd, rel=0.15)

    @pytest.mark.parametrize(("seed", "noise"), [(1, 1.0), (2, 1.0), (4, 3.0)])
    def test_it_fits_as_the_fit_does(self, seed: int, noise: float) -> None:
        """With noise three times what is stated the deviations grow as much."""
        stated = RIG.noise
        louder = stated.model_copy(
            update={name: noise * getattr(stated, name) for name in ("spot_sd_px", "speckle_sd_px")}
        )
        observations = World(RIG.model_copy(update={"noise": louder}), seed).observations(SHIPPED[::2], 10)
        advice = advise(RIG, observations, SHIPPED)
        assert advice is not None
        fitted = fit(RIG, observations)
        assert (fitted.noise_scale > 2) == (noise == 3.0)
        assert advice.relative_range_sd == pytest.approx(self.worst_of_fit(fitted), rel=1e-3)

    @pytest.mark.parametrize("told", [{"standoff_sd_mm": 5.0}, {"yaw_deg": 20.0}])
    def test_what_captures_tell_of_their_placement_counts(self, told: dict[str, Any]) -> None:
        """On a bench whose placements may be turned by much, and that has no tilt common to all."""
        bench = RIG.bench.model_copy(update={"target_tilt_sd_deg": 0.0, "tilt_sd_deg": 20.0})
        rig = RIG.model_copy(update={"bench": bench})
        plain = World(rig, 3).observations(SHIPPED[::2], 10)
        observations = [replace(s, **told) for s in plain]
        advice, without = advise(rig, observations, SHIPPED), advise(rig, plain, SHIPPED)
        assert advice is not None
        assert without is not None
        assert advice.relative_range_sd == pytest.approx(self.worst_of_fit(fit(rig, observations)), rel=1e-3)
        assert advice.relative_range_sd != pytest.approx(without.relative_range_sd, rel=1e-3)

    @staticmethod
    def worst_of_fit(fitted: CalibrationFit) -> float:
        """The worst range over the shipped procedure's span, the noise of its spot included."""
        sensors = Expectation(fitted.rig, fitted.values[None, fitted.sensor])
        free = sensors.table.free
        prior_sd = sensors.table.prior_sd[free]
        covariance = fitted.covariance[np.ix_(free, free)] / np.outer(prior_sd, prior_sd)
        spot = RIG.noise.model_copy(
            update={
                "spot_sd_px": RIG.noise.spot_sd_px * fitted.noise_scale * fitted.cells.repeat_scale,
                "speckle_sd_px": RIG.noise.speckle_sd_px * fitted.noise_scale,
            }
        )
        goals = RangeGoals.of(sensors, np.geomspace(125.0, 4500.0, 18), spot)
        return float(np.sqrt((goals.variance(covariance[None]) + goals.spot_sd**2).max()))

    @pytest.mark.parametrize("seed", [1, 2])
    def test_the_worst_residual_is_named(self, seed: int) -> None:
        """A spot that lies 3 px off is seen while the target still stands, by the final fit's residuals."""
        plain = World(RIG, seed).observations(SHIPPED[:6], 10)
        bad = ("L3", SHIPPED[4])
        observations = [
            replace(s, u_px=s.u_px + 3.0) if (s.laser_id, s.standoff_mm) == bad else s for s in plain
        ]
        advice, without = advise(RIG, observations, SHIPPED), advise(RIG, plain, SHIPPED)
        assert advice is not None
        assert without is not None
        assert (advice.worst_laser_id, advice.worst_standoff_mm) == bad
        assert 1.0 < advice.worst_residual_px < 3.1, "the fit takes some of it up"
        assert without.worst_residual_px < 0.3
        fitted = fit(RIG, plain)
        in_sd = np.nan_to_num(np.abs(fitted.residual_px) / (fitted.cells.sd_px * fitted.noise_scale))
        assert without.worst_residual_sd == pytest.approx(in_sd.max(), rel=0.01)
        assert without.worst_residual_px == pytest.approx(
            np.abs(fitted.residual_px).flat[int(in_sd.argmax())], rel=0.01
        )

    def test_too_little_is_no_advice(self) -> None:
        world = World(RIG, 3)
        assert advise(RIG, [], SHIPPED) is None
        assert advise(RIG, world.observations(SHIPPED[:1], 10), SHIPPED) is None

    def test_the_shipped_procedure_is_the_one_meant_here(self) -> None:
        steps = load_procedure(ROOT / "procedures/calibrate-flat.yaml").steps
        assert [s.standoffs_mm for s in steps if isinstance(s, CaptureGridStep)] == [SHIPPED]
