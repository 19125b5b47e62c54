"""Control flow of one reading: a capture of all lasers, then of ambiguous lasers one by one.

It is that of the thesis's main control (its Figure 17), as a table of states. A capture is: lasers on, frame,
all off, frame, difference, spots.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from enum import Enum
from typing import Final

import numpy as np

from workbench.ranging.alone import seen_twice, spots_on_line
from workbench.ranging.ranger import Assignment, Ranger, Reading, spot_arrays
from workbench.ranging.records import flag_notes
from workbench.spots import Finding, Spot

Capture = Callable[[tuple[str, ...]], Finding]
"""Captures a pair with the lasers of these ids on, and finds the spots."""


class State(Enum):
    """State of the control."""

    NORMAL = "all lasers on at once"
    ALTERNATIVE = "each ambiguous laser alone"
    ANSWER = "range and shape; the next reading starts with a normal capture"


class Seen(Enum):
    """Result of a state's captures."""

    NOTHING = "no spot"
    ASSIGNED = "every spot is assigned to a laser"
    AMBIGUOUS = "spots with several possible lasers"


NEXT: Final = {
    (State.NORMAL, Seen.NOTHING): State.ANSWER,
    (State.NORMAL, Seen.ASSIGNED): State.ANSWER,
    (State.NORMAL, Seen.AMBIGUOUS): State.ALTERNATIVE,
    (State.ALTERNATIVE, Seen.NOTHING): State.ANSWER,
    (State.ALTERNATIVE, Seen.ASSIGNED): State.ANSWER,
}


def acquire(ranger: Ranger, scene: str, capture: Capture) -> Reading:
    """Take one reading: a normal capture, and alternative captures of the lasers with ambiguous spots.

    The lines are assigned independently. A laser without a spot is captured again only where its spot may be
    merged with another.
    """
    control = _Control(ranger, scene, capture)
    state = State.NORMAL
    while state is not State.ANSWER:
        state = NEXT[state, control.run(state)]
    assert control.reading is not None  # noqa: S101 - every path to the answer includes a capture
    return control.reading


class _Control:
    """Data of one reading, kept between states."""

    def __init__(self, ranger: Ranger, scene: str, capture: Capture) -> None:
        self._ranger, self._scene, self._capture = ranger, scene, capture
        self._known: list[tuple[str, Spot]] = []
        self._ambiguous: tuple[str, ...] = ()
        self._notes: list[str] = []
        self.reading: Reading | None = None

    def run(self, state: State) -> Seen:
        """Run the captures of a state."""
        return self._normal() if state is State.NORMAL else self._alternative()

    def _normal(self) -> Seen:
        spots = self._capture(self._ranger.sensor.ids).spots
        assignment = self._ranger.assign_spots(spots)
        self._known, self._ambiguous = self._assigned(spots, assignment), assignment.ambiguous
        self._notes = list(assignment.notes)
        self.reading = self._ranger.read_assigned(self._scene, spots, assignment)
        if not spots:
            return Seen.NOTHING
        return Seen.AMBIGUOUS if assignment.ambiguous else Seen.ASSIGNED

    def _alternative(self) -> Seen:
        captures = [(laser_id, self._capture((laser_id,)).spots) for laser_id in self._ambiguous]
        on_line = dict(zip(self._ambiguous, spots_on_line(self._ranger.sensor, captures), strict=True))
        single = [(laser_id, spots[0]) for laser_id, spots in on_line.items() if len(spots) == 1]
        together = seen_twice(self._ranger.sensor, single)
        for laser_id, spots in on_line.items():
            if laser_id in together:
                self._notes.append(f"{laser_id}: not on alone, its spot is also that of another laser")
            elif len(spots) == 1:
                self._known.append((laser_id, spots[0]))
            else:
                self._notes.append(f"{laser_id}: on alone, {len(spots) or 'no'} spots on its line")
        ids, spots = [laser_id for laser_id, _ in self._known], [spot for _, spot in self._known]
        position, sd, speckle_sd = spot_arrays(spots)
        self._notes += flag_notes(ids, spots)
        fired = len(self._ranger.sensor.ids)
        without_spot = [i for i in self._ranger.sensor.ids if i not in ids and i not in self._ambiguous]
        reading = self._ranger.read_known(
            self._scene, fired, ids, position, sd, self._notes, without_spot, speckle_sd
        )
        # This state follows only a normal capture with spots.
        self.reading = replace(reading, status="not_enough_points") if not reading.lasers else reading
        return Seen.ASSIGNED if ids else Seen.NOTHING

    def _assigned(self, spots: tuple[Spot, ...], assignment: Assignment) -> list[tuple[str, Spot]]:
        ids = self._ranger.sensor.ids
        return [
            (ids[i], spots[n]) for i, n in np.stack((assignment.lasers, assignment.spots), axis=1).tolist()
        ]
