"""Calibrations with each lens for the programs of others, and what to do where such a program is missing."""

from __future__ import annotations

import os
from functools import cache
from typing import NoReturn

import pytest

from tests.support.rigs import (
    FISHEYE_STANDOFFS_MM,
    PROVENANCE,
    STANDOFFS_MM,
    World,
    fisheye_rig,
    thesis_rig,
)
from workbench.calibration.estimation.fit import fit
from workbench.calibration.verdict.export import calibrate
from workbench.model.acceptance import Acceptance
from workbench.model.calibration import Calibration

REQUIRED = "WORKBENCH_REQUIRE_CONSUMERS"
"""Set to 1, a missing program is a failure; otherwise its tests are skipped."""
RIGS = {"plumb_bob": (thesis_rig, STANDOFFS_MM), "equidistant": (fisheye_rig, FISHEYE_STANDOFFS_MM)}
"""Rig of each lens, and the standoffs of its calibration."""


@cache
def calibration_with(lens: str) -> Calibration:
    rig, standoffs_mm = RIGS[lens]
    world = World(rig(), 1)
    return calibrate(fit(world.rig, world.observations(standoffs_mm)), Acceptance(), PROVENANCE)[0]


def missing(what: str) -> NoReturn:
    """Skip the test, or fail where the program is required."""
    message = f"no {what} (Debian: see .ci/run)"
    if os.environ.get(REQUIRED) == "1":
        pytest.fail(message)
    pytest.skip(message)
