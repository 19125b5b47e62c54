"""Predicted uncertainty of a calibration, before any data."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import asdict, dataclass
from pathlib import Path

import pandas as pd

from workbench.api.arguments import millimetres_of, rig_of, whole_of
from workbench.calibration.design.forecast import forecast
from workbench.calibration.design.standoffs import best_standoffs
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig
from workbench.report.frames import DESIGN_PARAMETER_COLUMNS, DESIGN_RANGE_COLUMNS, frame_of


@dataclass(frozen=True)
class CalibrationDesign:
    """Result of `design`; medians over sensors drawn from the rig's tolerances, 1 sigma."""

    standoffs_mm: tuple[float, ...]
    repeats: int
    """Captures of each laser at each standoff."""
    parameters: pd.DataFrame
    """One row per parameter, by its name."""
    ranges: pd.DataFrame
    """One row per laser and range; relative deviations of a single range, and by the calibration alone."""
    worst_relative_sd: float
    """Largest relative deviation of a range from 0.1 to 5 m."""
    notes: tuple[str, ...]


def design(
    rig: str | Path | Rig,
    standoffs: float | Collection[float] | None = None,
    count: int = 11,
    repeats: int = 10,
) -> CalibrationDesign:
    """Predict what a calibration will determine, as `workbench design` does.

    Args:
        rig: a rig file, or its contents.
        standoffs: mm; None proposes `count` standoffs.
        count: number of proposed standoffs.
        repeats: captures of each laser at each standoff.

    Raises:
        BadInputError: an argument is wrong, or no laser has its spot in the image at a standoff.
    """
    model, captures = rig_of(rig), whole_of("repeats", repeats)
    if standoffs is None:
        chosen = best_standoffs(model, whole_of("count", count), captures)
    else:
        chosen = millimetres_of("standoffs", standoffs)
    if not chosen or min(chosen) <= 0:
        raise BadInputError(f"standoffs: expected at least one, and positive numbers in mm, got {chosen}")
    found = forecast(model, chosen, captures)
    parameters = [asdict(parameter) for parameter in found.parameters]
    index = pd.Index([parameter["name"] for parameter in parameters], name="parameter")
    return CalibrationDesign(
        standoffs_mm=found.standoffs_mm,
        repeats=found.repeats,
        parameters=frame_of(parameters, DESIGN_PARAMETER_COLUMNS).set_index(index),
        ranges=frame_of(map(asdict, found.ranges), DESIGN_RANGE_COLUMNS),
        worst_relative_sd=found.worst_relative_sd,
        notes=found.notes,
    )
