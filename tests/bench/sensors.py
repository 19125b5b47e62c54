"""Calibrations of virtual rigs without a session: fitted to positions that their truth would show."""

from __future__ import annotations

from dataclasses import asdict

from tests.support.rigs import PROVENANCE, World
from tests.support.virtual_truth import parameter_values
from workbench.calibration.estimation.fit import fit
from workbench.calibration.verdict.export import calibrate
from workbench.emulator.spec import emulator_spec
from workbench.emulator.truth import draw_truth
from workbench.model.acceptance import Acceptance
from workbench.model.calibration import Calibration
from workbench.model.rig import Rig


def calibration_of(rig: Rig) -> Calibration:
    """What a calibration of the virtual bench of `rig` would have found, noise and placements included."""
    truth = asdict(draw_truth(rig, emulator_spec(rig)))
    world = World(rig, 1)
    world.values = parameter_values(truth)
    provenance = PROVENANCE.model_copy(update={"rig": rig.rig, "serial": rig.serial})
    calibration, assessment = calibrate(fit(rig, world.observations()), Acceptance(), provenance)
    assert assessment.verdict == "accepted", assessment.reasons
    return calibration
