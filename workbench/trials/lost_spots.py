"""Spots that the readings of a trial lack, with their causes, and the causes that were expected."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from workbench.model.event import ReadingTaken
from workbench.model.table import Column, Table
from workbench.model.target import Placement
from workbench.trials.spot_map import SpotMap


@dataclass(frozen=True)
class LostSpot:
    """Spot of one laser at one placement that readings lack, or were expected to lack."""

    standoff_mm: float
    laser_id: str
    lost: int
    """Number of readings without this laser, of those in which its beam reached the target."""
    readings: int
    cause: str
    """Most frequent cause; empty if no reading lacks the laser."""
    expected: str
    """Cause by the map of spots; empty: the spot was expected."""


def lost_spots(placement: Placement, readings: Sequence[ReadingTaken], expected: SpotMap) -> list[LostSpot]:
    """Lost spots at one placement; lasers that were left off or blocked do not count there."""
    causes = expected.lost(placement)
    found = []
    for laser_id in expected.ids:
        used = [one for one in readings if laser_id not in (*one.left_off, *one.blocked)]
        lost = [one for one in used if laser_id not in {laser.laser_id for laser in one.lasers}]
        if used and (lost or laser_id in causes):
            found.append(
                LostSpot(
                    placement.standoff_mm,
                    laser_id,
                    len(lost),
                    len(used),
                    _cause(laser_id, lost),
                    causes.get(laser_id, ""),
                )
            )
    return found


def lost_table(name: str, spots: Sequence[LostSpot]) -> list[Table]:
    """Table of the lost spots; empty list if none is lost."""
    if not spots:
        return []
    columns = (
        Column(key="standoff_mm", name="standoff", unit="mm"),
        Column(key="laser_id", name="laser"),
        Column(key="lost", name="lost"),
        Column(key="readings", name="of"),
        Column(key="cause", name="cause"),
        Column(key="expected", name="expected"),
    )
    rows = tuple(tuple(getattr(one, column.key) for column in columns) for one in spots)
    return [
        Table(
            name=f"{name}-lost-spots",
            title="Lost spots",
            columns=columns,
            rows=rows,
            caption="expected: by the calibration; empty where a spot was expected",
        )
    ]


def _cause(laser_id: str, lost: Sequence[ReadingTaken]) -> str:
    """Most frequent cause in the notes of readings, without the name of the laser."""
    causes = Counter(
        note.removeprefix(f"{laser_id}: ")
        for one in lost
        for note in (one.notes or (one.cause,))
        if note.startswith(f"{laser_id}: ") or not one.lasers
    )
    return causes.most_common(1)[0][0] if causes else ("" if not lost else "not assigned to a spot")
