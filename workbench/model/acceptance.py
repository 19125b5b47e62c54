"""Limits on a calibration."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from workbench.model.rig import PositiveFloat
from workbench.model.yamlfile import FileModel

FEWEST_STANDOFFS = 3
"""Minimum number of standoffs per laser: two determine its line, the third is the first that tests it."""


class Acceptance(FileModel):
    """Limits that a calibration must meet to be exported."""

    max_rms_px: PositiveFloat = 1.0
    max_relative_range_sd: PositiveFloat = 0.05
    """Limit on sd(range) / range (1 sigma) of every laser between the nearest and the farthest standoff."""
    max_drift_px: PositiveFloat = 1.0
    """Shift of the image from the first capture to the last, in u or v."""
    max_placement_scale: Annotated[float, Field(ge=1)] = 5.0
    """Scatter of the placements over what the rig file states."""
    min_standoffs: Annotated[int, Field(ge=FEWEST_STANDOFFS)] = FEWEST_STANDOFFS
    """Minimum number of standoffs of each laser."""
