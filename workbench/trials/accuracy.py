"""The accuracy trial: readings of a flat at known standoffs, and their errors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from workbench.model.event import TrialRow
from workbench.model.rig import BenchSpec
from workbench.ranging.ranger import Reading


def accuracy_csv(rows: Sequence[TrialRow]) -> str:
    """The trial's table as CSV, a line a standoff, columns as in `TrialRow`."""
    return pd.DataFrame([row.model_dump() for row in rows]).to_csv(index=False, lineterminator="\n")


def accuracy_row(standoff_mm: float, readings: Sequence[Reading], bench: BenchSpec) -> TrialRow:
    """Statistics of the readings at one standoff; errors are measured - true, mm, 1 sigma.

    The standard deviation over the readings shows what differs between them. What they share (calibration,
    speckle, placement) it cannot show: hold the mean error against the stated deviations instead. The range's
    contains the ruler's scale, which cancels where the calibration was made with the same ruler.

    Args:
        standoff_mm: true range, by the ruler.
        readings: every reading taken there; those without a range count as missing.
        bench: how well the standoff is known.
    """
    ranges = np.array([r.flat_mm for r in readings if r.flat_mm is not None])
    stated = np.array([r.flat_sigma_mm for r in readings if r.flat_sigma_mm is not None])
    if not len(ranges):
        return TrialRow(
            standoff_mm=standoff_mm, readings=0, missing=len(readings), reference_sd_mm=bench.placement_sd_mm
        )
    error = ranges - standoff_mm
    return TrialRow(
        standoff_mm=standoff_mm,
        readings=len(ranges),
        missing=len(readings) - len(ranges),
        mean_error_mm=float(error.mean()),
        max_error_mm=float(error.max()),
        min_error_mm=float(error.min()),
        sd_mm=float(error.std(ddof=1)) if len(error) > 1 else None,
        range_sd_mm=float(np.sqrt((stated**2).mean())),
        reference_sd_mm=bench.placement_sd_mm,
    )
