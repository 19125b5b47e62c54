"""One reading of the sensor: all lasers at once, and each alone where that does not tell enough.

The control flow of the thesis's main control (its Figure 17), as a table of states. A capture is: lasers on,
frame, all off, frame, subtract, spots.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from enum import Enum
from typing import Final

import numpy as np

from workbench.ranging.ranger import Assignment, Ranger, Reading, spot_arrays
from workbench.ranging.records import flag_notes
from workbench.spots import Finding, Spot

Shoot = Callable[[tuple[str, ...]], Finding]
"""Fires the lasers with these ids, captures a pair and finds the spots."""


class State(Enum):
    """Where the control is."""

    NORMAL = "every laser lit at once"
    ALTERNATIVE = "each laser whose spot was not told, alone"
    ANSWER = "range and shape; the next reading starts with a normal capture"


class Seen(Enum):
    """What a state's captures showed."""

    NOTHING = "no spot"
    ASSIGNED = "every spot is some laser's"
    AMBIGUOUS = "spots that may be one laser's or another's"


NEXT: Final = {
    (State.NORMAL, Seen.NOTHING): State.ANSWER,
    (State.NORMAL, Seen.ASSIGNED): State.ANSWER,
    (State.NORMAL, Seen.AMBIGUOUS): State.ALTERNATIVE,
    (State.ALTERNATIVE, Seen.NOTHING): State.ANSWER,
    (State.ALTERNATIVE, Seen.ASSIGNED): State.ANSWER,
}


def acquire(ranger: Ranger, scene: str, shoot: Shoot) -> Reading:
    """One reading: normal capture, and alternative capture of the lasers whose spots cannot be told apart.

    A line that is told stands whatever becomes of the other one. Spots that are missing are not asked for
    again where the others are told, unless they may hide in one of these.
    """
    control = _Control(ranger, scene, shoot)
    state = State.NORMAL
    while state is not State.ANSWER:
        state = NEXT[state, control.run(state)]
    assert control.reading is not None  # noqa: S101 - every way to the answer leads through a capture
    return control.reading


class _Control:
    """What is carried from one state to the next."""

    def __init__(self, ranger: Ranger, scene: str, shoot: Shoot) -> None:
        self._ranger, self._scene, self._shoot = ranger, scene, shoot
        self._known: list[tuple[str, Spot]] = []
        self._ambiguous: tuple[str, ...] = ()
        self._notes: list[str] = []
        self.reading: Reading | None = None

    def run(self, state: State) -> Seen:
        """Do what a state asks for, and tell what was seen."""
        return self._normal() if state is State.NORMAL else self._alternative()

    def _normal(self) -> Seen:
        spots = self._shoot(self._ranger.sensor.ids).spots
        assignment = self._ranger.assign_spots(spots)
        self._known, self._ambiguous = self._of(spots, assignment), assignment.ambiguous
        self._notes = list(assignment.notes)
        self.reading = self._ranger.read_assigned(self._scene, spots, assignment)
        if not spots:
            return Seen.NOTHING
        return Seen.AMBIGUOUS if assignment.ambiguous else Seen.ASSIGNED

    def _alternative(self) -> Seen:
        for laser_id in self._ambiguous:
            spots = self._ranger.alone(laser_id, self._shoot((laser_id,)).spots)
            if len(spots) == 1:
                self._known.append((laser_id, spots[0]))
            else:
                self._notes.append(f"{laser_id}: fired alone, {len(spots) or 'no'} spots on its line")
        ids, spots = [laser_id for laser_id, _ in self._known], [spot for _, spot in self._known]
        position, sd = spot_arrays(spots)
        self._notes += flag_notes(ids, spots)
        fired = len(self._ranger.sensor.ids)
        unseen = [i for i in self._ranger.sensor.ids if i not in ids and i not in self._ambiguous]
        reading = self._ranger.read_known(self._scene, fired, ids, position, sd, self._notes, unseen)
        # The normal capture showed spots, or this one would not have been asked for.
        self.reading = replace(reading, status="not_enough_points") if not reading.lasers else reading
        return Seen.ASSIGNED if ids else Seen.NOTHING

    def _of(self, spots: tuple[Spot, ...], assignment: Assignment) -> list[tuple[str, Spot]]:
        ids = self._ranger.sensor.ids
        return [
            (ids[i], spots[n]) for i, n in np.stack((assignment.lasers, assignment.spots), axis=1).tolist()
        ]
