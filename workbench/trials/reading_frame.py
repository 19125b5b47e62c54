"""Readings of a trial as a data frame: the common form for statistics, one row a reading."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pandas as pd

from workbench.model.arrays import FloatArray
from workbench.model.event import ReadingTaken
from workbench.model.table import Cell, Column, Table
from workbench.trials.statistics.autocorrelation import (
    INDEPENDENT,
    SHORTEST_SERIES,
    Autocorrelation,
    autocorrelation,
)

COLUMNS = (
    "standoff_mm",
    "true_mm",
    "measured_mm",
    "error_mm",
    "stated_u_mm",
    "spot_u_mm",
    "reference_u_mm",
    "placement_u_mm",
    "placement",
    "repeat",
    "session",
    "status",
)
"""Columns of a trial's readings, see docs/trials.md. Statistics need all but the uncertainties
and `status`."""


def reading_rows(
    readings: Sequence[ReadingTaken], standoff_mm: float, placement: int, session: str = "1"
) -> list[dict[str, object]]:
    """Rows of the readings at one placement.

    Args:
        readings: readings at the placement.
        standoff_mm: requested standoff, which is the level; the true range is that of the readings.
        placement: number of the placement at this level.
        session: session, or operator, of the placement.
    """
    return [
        {
            "standoff_mm": standoff_mm,
            "true_mm": one.reference_mm,
            "measured_mm": one.range_mm,
            "error_mm": one.error_mm,
            "stated_u_mm": one.sigma_mm,
            "spot_u_mm": one.spot_sd_mm,
            "reference_u_mm": one.reference_sd_mm,
            "placement_u_mm": one.placement_sd_mm,
            "placement": placement,
            "repeat": one.reading,
            "session": session,
            "status": one.cause or one.status,
        }
        for one in readings
    ]


def reading_frame(rows: Sequence[Mapping[str, object]]) -> pd.DataFrame:
    """Data frame of rows with the keys `COLUMNS`; a missing number is NaN."""
    frame = pd.DataFrame(list(rows), columns=list(COLUMNS))
    numbers = [name for name in COLUMNS if name.endswith("_mm")]
    return frame.astype(dict.fromkeys(numbers, np.float64))


def levels(frame: pd.DataFrame) -> Iterator[tuple[float, pd.DataFrame]]:
    """Levels in ascending order: requested standoff, mm, and its readings."""
    for standoff_mm, readings in frame.groupby("standoff_mm"):
        yield float(str(standoff_mm)), readings


def dependence(frame: pd.DataFrame) -> Autocorrelation:
    """Autocorrelation of successive repeats, pooled over all placements.

    Each level is scaled by its own standard deviation, so that no level dominates.
    """
    used = frame.dropna(subset=["error_mm"]).sort_values("repeat", kind="stable")
    if not (used.groupby(["standoff_mm", "session", "placement"]).size() >= SHORTEST_SERIES).any():
        return INDEPENDENT
    series: list[FloatArray] = []
    for _, level in levels(used):
        cells = level.groupby(["session", "placement"])["error_mm"]
        spread = float(np.sqrt(cells.var(ddof=1).mean()))
        if spread > 0:
            series += [group.to_numpy(np.float64) / spread for _, group in cells]
    return autocorrelation(series)


def table_of(
    name: str, title: str, columns: Sequence[Column], rows: Sequence[Mapping[str, Cell]], caption: str
) -> Table:
    """Table of rows by column key; a missing key is an empty cell."""
    cells = tuple(tuple(row.get(column.key) for column in columns) for row in rows)
    return Table(name=name, title=title, columns=tuple(columns), rows=cells, caption=caption)
