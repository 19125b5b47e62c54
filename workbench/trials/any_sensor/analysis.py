"""Analysis of readings of any range sensor: table of one kind of trial, and reservations."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from workbench.model.table import Table
from workbench.trials.any_sensor.accuracy_table import accuracy_table
from workbench.trials.any_sensor.linearity_table import linearity_table
from workbench.trials.gauge_rr.table import gauge_table
from workbench.trials.reading_frame import dependence, levels
from workbench.trials.repeatability.table import precision_table
from workbench.trials.statistics.autocorrelation import Autocorrelation
from workbench.trials.statistics.clipping import clipped

KINDS: Mapping[str, Callable[[str, pd.DataFrame], Table]] = {
    "accuracy": accuracy_table,
    "repeatability": precision_table,
    "gauge-rr": gauge_table,
    "linearity": linearity_table,
}
"""Kinds of trial, each with the table of readings in a frame of `reading_frame.COLUMNS`."""


@dataclass(frozen=True)
class ClippedLevel:
    """Readings at the end of the sensor's scale, at one true range."""

    standoff_mm: float
    limit_mm: float
    """Value at which they are clipped."""
    clipped: int
    readings: int


@dataclass(frozen=True)
class Analysis:
    """Result of the analysis of a file of readings."""

    kind: str
    readings: int
    """Number of readings with a range."""
    missing: int
    longest_mm: float
    """Longest true range."""
    autocorrelation: Autocorrelation
    clipped: tuple[ClippedLevel, ...]
    """Levels with clipped readings, which the table leaves out."""
    table: Table


def analyse(kind: str, frame: pd.DataFrame) -> Analysis:
    """Analyse readings as the trial `kind`, one of `KINDS`.

    Clipped readings have no error distribution: their levels are reported, and left out of the table.

    Args:
        kind: key of `KINDS`.
        frame: readings, see `reading_frame.COLUMNS`.
    """
    limits = _clipped_levels(frame)
    used = frame[~frame["standoff_mm"].isin([level.standoff_mm for level in limits])]
    return Analysis(
        kind=kind,
        readings=int(frame["measured_mm"].count()),
        missing=int(frame["measured_mm"].isna().sum()),
        longest_mm=float(frame["true_mm"].max()),
        autocorrelation=dependence(used),
        clipped=limits,
        table=KINDS[kind](kind, used),
    )


def _clipped_levels(frame: pd.DataFrame) -> tuple[ClippedLevel, ...]:
    at_limit = clipped(frame)
    found = []
    for standoff_mm, readings in levels(frame):
        here = at_limit[(frame["standoff_mm"] == standoff_mm).to_numpy(np.bool_)]
        if here.any():
            limit = float(readings["measured_mm"].to_numpy(np.float64)[here][0])
            found.append(ClippedLevel(standoff_mm, limit, int(here.sum()), len(readings)))
    return tuple(found)
