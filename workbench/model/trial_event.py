"""Events of a trial: readings, progress, and results as tables and charts."""

from __future__ import annotations

from typing import Literal

from workbench.model.chart import Chart
from workbench.model.table import Table
from workbench.model.yamlfile import FileModel


class LaserRange(FileModel):
    """Range of one laser's spot from the reference plane, 1 sigma."""

    laser_id: str
    range_mm: float
    sigma_mm: float
    u_px: float | None
    v_px: float | None
    low_mm: float | None = None
    high_mm: float | None = None
    """Upper end of the 95 % interval, which is not symmetric; None if it reaches infinity."""


class ReadingTaken(FileModel):
    """One reading of a trial."""

    kind: Literal["reading_taken"] = "reading_taken"
    trial: str
    scene: str
    standoff_mm: float
    reading: int
    status: Literal["done", "not_enough_points", "no_points"]
    range_mm: float | None
    """Mean of the lasers weighted by their spots' uncertainty: the range of a flat target."""
    sigma_mm: float | None
    """Stated standard uncertainty of `range_mm`."""
    reference_sd_mm: float | None = None
    """Reference uncertainty of `standoff_mm`; None if unknown."""
    lasers: tuple[LaserRange, ...]


class TrialProgress(FileModel):
    """A part of a trial is complete."""

    kind: Literal["trial_progress"] = "trial_progress"
    trial: str
    text: str
    """Summary in one line."""


class TrialFinished(FileModel):
    """Results of a trial as data for any renderer."""

    kind: Literal["trial_finished"] = "trial_finished"
    trial: str
    """Name of the step."""
    tables: tuple[Table, ...] = ()
    charts: tuple[Chart, ...] = ()
