"""Rangers calibrated by simulation, and the spots that targets at given ranges make for them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np

from tests.support.rigs import PROVENANCE, World, prior, thesis_rig
from workbench.calibration.estimation.fit import fit
from workbench.calibration.verdict.export import calibrate
from workbench.model.acceptance import Acceptance
from workbench.model.arrays import FloatArray
from workbench.ranging.ranger import Ranger
from workbench.spots import Spot

IDS = ("L1", "L2", "L3", "L4")
X_MM = (-60.0, -30.0, 30.0, 60.0)
"""Baselines of the lasers as designed."""


def ranger_in(world: World) -> Ranger:
    """The ranger of a simulated calibration of a simulated sensor."""
    return Ranger(calibrate(fit(world.rig, world.observations()), Acceptance(), PROVENANCE)[0])


@cache
def thesis_ranger() -> Ranger:
    """Four horizontal lasers, drawn from the tolerances of the design."""
    return ranger_in(World(thesis_rig(), 1))


@cache
def coplanar_ranger() -> Ranger:
    """Beams in one plane with the pinhole to a micrometre: every spot lies on the line of every laser."""
    rig = thesis_rig()
    level = {"y_mm": prior(0.0, 1e-3), "ty": prior(0.0, 1e-6)}
    rig = rig.model_copy(update={"lasers": tuple(laser.model_copy(update=level) for laser in rig.lasers)})
    return ranger_in(World(rig, 1))


def positions(ranger: Ranger, ranges_mm: Mapping[str, float]) -> FloatArray:
    """(n, 2) exact spot positions of lasers at ranges."""
    return np.concatenate([ranger.sensor.spot_px(i, np.array([r])) for i, r in ranges_mm.items()])


def spot_at(u_px: float, v_px: float) -> Spot:
    """A clear spot with a standard deviation of 0.03 px."""
    return Spot(u_px, v_px, 0.03, 0.03, 1e4, 1.5, 150.0)


def spots(ranger: Ranger, ranges_mm: Mapping[str, float]) -> list[Spot]:
    """Spots at `positions`."""
    return [spot_at(u, v) for u, v in positions(ranger, ranges_mm).tolist()]
