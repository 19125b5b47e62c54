"""Calibrations of virtual rigs without a session: fitted to positions that their truth would show."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from tests.support.rigs import PROVENANCE, World
from workbench.calibration.estimation.fit import fit
from workbench.calibration.model.parameters import DRIFT
from workbench.calibration.verdict.export import calibrate
from workbench.emulator.spec import emulator_spec
from workbench.emulator.truth import draw_truth
from workbench.model.acceptance import Acceptance
from workbench.model.calibration import Calibration
from workbench.model.rig import TARGET_TILT, Rig


def calibration_of(rig: Rig) -> Calibration:
    """What a calibration of the virtual bench of `rig` would have found, noise and placements included."""
    truth = asdict(draw_truth(rig, emulator_spec(rig)))
    world = World(rig, 1)
    world.values = {name: value for name, value in truth.items() if isinstance(value, float)}
    tilt = np.tan(np.radians([truth["target_yaw_deg"], truth["target_pitch_deg"]])).tolist()
    world.values |= dict(zip(TARGET_TILT, tilt, strict=True)) | dict.fromkeys(DRIFT, 0.0)
    for laser_id, ray in truth["lasers"].items():
        world.values |= {f"{laser_id}.{name}": value for name, value in ray.items()}
    provenance = PROVENANCE.model_copy(update={"rig": rig.rig, "serial": rig.serial})
    calibration, assessment = calibrate(fit(rig, world.observations()), Acceptance(), provenance)
    assert assessment.verdict == "accepted", assessment.reasons
    return calibration
