"""One reading of the sensor: all lasers at once, and each alone where that does not tell enough."""

from __future__ import annotations

from collections.abc import Callable

from workbench.ranging.ranger import Ranger, Reading, spot_arrays
from workbench.spots import Finding

Shoot = Callable[[tuple[str, ...]], Finding]
"""Fires the lasers with these ids, captures a pair and finds the spots."""


def acquire(ranger: Ranger, scene: str, shoot: Shoot) -> Reading:
    """Main control of the thesis (its Figure 17): normal capture, then alternative capture if need be.

    Normal capture lights every laser. Unless each made a spot that can be told from the others, alternative
    capture fires each alone, so that one capture shows one laser.
    """
    ids = ranger.sensor.ids
    reading = ranger.read_lit(scene, shoot(ids).spots)
    return reading if reading.status == "done" else _alternative(ranger, scene, shoot)


def _alternative(ranger: Ranger, scene: str, shoot: Shoot) -> Reading:
    found = [(i, spots[0]) for i in ranger.sensor.ids if len(spots := shoot((i,)).spots) == 1]
    position, sd = spot_arrays([spot for _, spot in found])
    return ranger.read_known(scene, len(ranger.sensor.ids), [i for i, _ in found], position, sd)
