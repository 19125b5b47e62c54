"""Table of the linearity of readings over their true ranges."""

from __future__ import annotations

import numpy as np
import pandas as pd

from workbench.model.table import Cell, Column, Table
from workbench.trials.reading_frame import table_of
from workbench.trials.statistics.estimate import TooFewReadingsError
from workbench.trials.statistics.linearity import linearity

COLUMNS = (
    Column(key="levels", name="true ranges"),
    Column(key="readings", name="n"),
    Column(key="full_scale_mm", name="full scale", unit="mm"),
    Column(key="independent_mm", name="independent", unit="mm", format=".3g"),
    Column(key="independent_percent", name="independent", unit="% FS", format=".3g"),
    Column(key="absolute_mm", name="absolute", unit="mm", format=".3g"),
    Column(key="absolute_percent", name="absolute", unit="% FS", format=".3g"),
    Column(key="slope", name="slope", format=".5f"),
    Column(key="intercept_mm", name="intercept", unit="mm", format="+.3g"),
    Column(key="residual_sd_mm", name="residual sd", unit="mm", format="sd"),
    Column(key="note", name="note"),
)
CAPTION = (
    "largest deviation of a mean reading: independent from the best line, absolute from measured = true;"
    " slope, intercept: least squares; full scale: span of the true ranges"
)


def linearity_table(name: str, frame: pd.DataFrame) -> Table:
    """Table of linearity in one row, from the mean error of the placements at each level.

    Args:
        name: name of the table.
        frame: readings, see `reading_frame.COLUMNS`; those without a range are left out.
    """
    used = frame.dropna(subset=["error_mm"])
    placements = used.groupby(["standoff_mm", "session", "placement"])["error_mm"].mean()
    means = placements.groupby(level=0).mean()
    true = means.index.to_numpy(np.float64)
    row: dict[str, Cell] = {"levels": len(means), "readings": len(used), "note": ""}
    try:
        found = linearity(true, true + means.to_numpy(np.float64))
    except TooFewReadingsError as error:
        row["note"] = f"no statistics: {error}"
    else:
        row |= {
            "full_scale_mm": found.full_scale_mm,
            "independent_mm": found.independent_mm,
            "independent_percent": found.independent_percent,
            "absolute_mm": found.absolute_mm,
            "absolute_percent": found.absolute_percent,
            "slope": found.slope,
            "intercept_mm": found.intercept_mm,
            "residual_sd_mm": found.rms_mm,
        }
    return table_of(name, "Linearity", COLUMNS, [row], CAPTION)
