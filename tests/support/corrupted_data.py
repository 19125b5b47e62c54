"""Simulated calibrations with something wrong in them."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from tests.support.rigs import World
from workbench.calibration.data.observations import Observation


def exchanged(observations: list[Observation], a: str, b: str) -> list[Observation]:
    """Two lasers wired the wrong way round."""
    other = {a: b, b: a}
    return [replace(s, laser_id=other.get(s.laser_id, s.laser_id)) for s in observations]


def mirrored(world: World, observations: list[Observation]) -> list[Observation]:
    return [replace(s, u_px=world.rig.camera.width_px - 1 - s.u_px) for s in observations]


def stated_as(observations: list[Observation], standoff_mm: float, stated_mm: float) -> list[Observation]:
    return [replace(s, standoff_mm=stated_mm) if s.standoff_mm == standoff_mm else s for s in observations]


def shifted(
    observations: list[Observation],
    laser_id: str,
    standoff_mm: float,
    by_px: float,
    repeats: Collection[int] = range(99),
) -> list[Observation]:
    """Some repeats of one spot seen elsewhere, across and along alike."""
    return [
        replace(s, u_px=s.u_px + by_px, v_px=s.v_px + 0.1 * by_px)
        if (s.laser_id, s.standoff_mm) == (laser_id, standoff_mm) and s.repeat in repeats
        else s
        for s in observations
    ]


def moved(
    world: World, observations: list[Observation], standoff_mm: float, after: int, step_mm: float
) -> list[Observation]:
    """A target that moves by `step_mm` after so many captures of its placement."""
    found, seen = [], 0
    z0 = standoff_mm + world.values["offset_mm"]
    for s in observations:
        if s.standoff_mm == standoff_mm:
            seen += 1
            if seen > after:
                du, dv = world.pixel(s.laser_id, z0 + step_mm) - world.pixel(s.laser_id, z0)
                s = replace(s, u_px=s.u_px + float(du), v_px=s.v_px + float(dv))
        found.append(s)
    return found


def turned_at(world: World, standoff_mm: float, turn_deg: float) -> list[Observation]:
    """A whole calibration with the target turned about the vertical at one placement."""
    z0 = standoff_mm + world.values["offset_mm"]
    found = []
    for s in world.observations():
        if s.standoff_mm == standoff_mm:
            du, dv = world.pixel(s.laser_id, z0, np.radians(turn_deg)) - world.pixel(s.laser_id, z0)
            s = replace(s, u_px=s.u_px + float(du), v_px=s.v_px + float(dv))
        found.append(s)
    return found
