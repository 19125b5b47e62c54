"""Limits of the accuracy trial."""

from __future__ import annotations

from pydantic import model_validator

from workbench.model.limit import Limit
from workbench.model.yamlfile import FileModel
from workbench.procedure.engine.limits import refuse_retry


class AccuracyLimits(FileModel):
    """Limits on the mean error at every standoff, with guard bands, and on the test of the bias."""

    closest_error_mm: Limit | None = None
    closest_relative_error: Limit | None = None
    mean_error_mm: Limit | None = None
    mean_relative_error: Limit | None = None
    laser_error_mm: Limit | None = None
    laser_relative_error: Limit | None = None
    bias_p: Limit | None = None

    _no_retry = model_validator(mode="after")(refuse_retry)
