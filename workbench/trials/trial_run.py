"""A running trial: its placements, with checks of the readings at each, and remarks in its results."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from workbench.model.chart import Chart
from workbench.model.event import ReadingTaken, TrialProgress
from workbench.model.reading_text import reading_remark
from workbench.model.table import Column, Table
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.placements import settle, visit_placements
from workbench.trials.limits import Result, check_results, skipped_results
from workbench.trials.lost_spots import lost_spots, lost_table
from workbench.trials.readings import session_ranger
from workbench.trials.results import finish_trial
from workbench.trials.spot_map import SpotMap
from workbench.trials.target_check import other_target
from workbench.trials.trial_step import ResultLimits, outside_prompt

T = TypeVar("T")
MOST_OUTSIDE = 2
"""Largest number of readings that the question about a placement describes."""


class TrialRun:
    """Execution of one trial in a session."""

    def __init__(self, context: Context, name: str) -> None:
        """Begin the trial of the step `name`.

        Raises:
            BadInputError: there is no calibration.
        """
        self.context, self.name = context, name
        self.ranger = session_ranger(context, name)
        self._map = SpotMap.of_calibration(self.ranger.calibration, context.rig)
        self._remarks: dict[str, str] = {}
        self._placements: dict[str, Placement] = {}
        self.skipped: list[Placement] = []
        """Planned placements that the operator skipped."""

    def visit(self, placements: Sequence[Placement], work: Callable[[Placement], T]) -> list[T]:
        """Run the work at each placement, then check its readings; see `visit_placements`.

        Another target than the one asked for is named at once. Readings outside their 95 % interval are kept,
        or taken again with a reason.

        Raises:
            AnswerNeededError, StoppedError, LaserOffNotConfirmedError: see `Context.ask`.
        """

        def checked(placed: Placement) -> tuple[str, T]:
            result = work(placed)
            self._check(placed)
            return placed.key, result

        visited = dict(visit_placements(self.context, placements, checked))
        self.skipped += [one for one in placements if one.key not in visited]
        return list(visited.values())

    def expected_ids(self, placement: Placement) -> list[str]:
        """Lasers whose spots the map of spots expects at a placement."""
        lost = self._map.lost(placement)
        return [one for one in self._map.ids if one not in lost]

    def check(self, results: Sequence[Result], limits: ResultLimits) -> None:
        """Compare the results with the limits; a skipped placement leaves every limit undecided.

        Raises:
            WorkbenchError: see `check_results`.
        """
        skipped = skipped_results(self.skipped, limits)
        check_results(self.context, self.name, [*results, *skipped], limits)

    def finish(self, tables: Sequence[Table], charts: Sequence[Chart] = ()) -> None:
        """Write and journal the results, with lost spots and remarks; see `finish_trial`.

        Raises:
            StoppedError: the disk is full or cannot be written.
        """
        lost = [
            row
            for key, placement in self._placements.items()
            for row in lost_spots(placement, self._readings(key), self._map)
        ]
        finish_trial(
            self.context, self.name, [*tables, *lost_table(self.name, lost), *self._remark_table()], charts
        )

    def _check(self, placed: Placement) -> None:
        self._placements[placed.key] = placed
        if not placed.is_measured:
            return  # neither distance nor angle of the target were asked for
        readings = self._readings(placed.key)
        complete = [one for one in readings if not one.left_off and not one.blocked]
        self._remarks.pop(placed.key, None)
        if other := other_target(self.ranger.sensor, complete, placed, self.context.rig.bench):
            self._remarks[placed.key] = other
            self.context.emit(TrialProgress(trial=self.name, text=f"{placed.standoff_mm:g} mm: {other}"))
        if outside := [one for one in readings if one.is_outside]:
            found = "; ".join(map(reading_remark, outside[:MOST_OUTSIDE]))
            more = f"; and {len(outside) - MOST_OUTSIDE} more" if len(outside) > MOST_OUTSIDE else ""
            settle(self.context, outside_prompt(placed, found + more), "reading outside its 95 % interval")

    def _readings(self, key: str) -> list[ReadingTaken]:
        return [one for one in self.context.readings if one.scene.startswith(f"{key}/")]

    def _remark_table(self) -> list[Table]:
        """Table of targets that were not those asked for, and of placements taken again or skipped."""
        again = [
            (event.key, f"{'skipped' if event.left_out else 'taken again'}: {event.reason}")
            for event in self.context.recorder.set_aside(f"{self.name}/")
        ]
        rows = [(key, text) for key, text in [*self._remarks.items(), *again]]
        if not rows:
            return []
        columns = (Column(key="placement", name="placement"), Column(key="remark", name="remark"))
        return [Table(name=f"{self.name}-remarks", title="Remarks", columns=columns, rows=tuple(rows))]
