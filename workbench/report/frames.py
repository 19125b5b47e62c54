"""Data frames of sessions and calibrations: their columns, and how records become rows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import pandas as pd

from workbench.model.table import Table

SPOT_COLUMNS = (
    "capture",
    "laser_id",
    "standoff_mm",
    "repeat",
    "u_px",
    "v_px",
    "u_sd_px",
    "v_sd_px",
    "u_speckle_sd_px",
    "v_speckle_sd_px",
    "flux_dn",
    "width_px",
    "peak_dn",
    "flags",
)
CAPTURE_COLUMNS = (
    "capture",
    "purpose",
    "placement",
    "scene",
    "laser_id",
    "standoff_mm",
    "standoff_sd_mm",
    "repeat",
    "exposure",
    "exposure_unit",
    "time",
    "on",
    "off",
)
RESIDUAL_COLUMNS = ("laser_id", "standoff_mm", "u_px", "v_px", "u_sd_px", "v_sd_px")
CROSS_VALIDATION_COLUMNS = ("placement", "standoff_mm", "error_mm", "sd_mm", "z", "alarm")
READING_COLUMNS = (
    "trial",
    "scene",
    "standoff_mm",
    "reading",
    "status",
    "range_mm",
    "sigma_mm",
    "error_mm",
    "reference_sd_mm",
    "true_mm",
    "closest_mm",
    "closest_sigma_mm",
    "angle_deg",
    "angle_sd_deg",
    "radius_mm",
    "radius_sd_mm",
    "cause",
)
SESSION_COLUMNS = ("session", "folder", "state", "procedures", "captures", "reason")
PARAMETER_COLUMNS = ("unit", "value", "sd", "prior_sd", "data_share", "determined_by")
UNCERTAINTY_COLUMNS = ("laser_id", "range_mm", "sd_mm", "noise_mm", "speckle_mm", "calibration_mm")
DIFFERENCE_COLUMNS = ("laser_id", "range_mm", "difference_mm", "sd_mm")
DESIGN_PARAMETER_COLUMNS = ("unit", "prior_sd", "sd", "data_share", "determined_by")
DESIGN_RANGE_COLUMNS = ("laser_id", "range_mm", "relative_sd", "relative_sd_of_calibration")
SIMULATED_PARAMETER_COLUMNS = ("sensor", "parameter", "true", "value", "sd")
SIMULATED_RANGE_COLUMNS = ("sensor", "laser_id", "range_mm", "error_mm", "sd_mm")


def frame_of(rows: Iterable[Mapping[str, Any]], columns: Sequence[str]) -> pd.DataFrame:
    """Data frame with these columns, also without rows; a missing value is NaN."""
    frame = pd.DataFrame([[row[name] for name in columns] for row in rows], columns=list(columns))
    missing = [name for name in columns if len(frame) and frame[name].isna().all()]
    return frame.astype(dict.fromkeys(missing, float))


def frame_of_table(table: Table) -> pd.DataFrame:
    """Data frame of a table: the keys of its columns, unscaled values."""
    return frame_of(table.records(), [column.key for column in table.columns])
