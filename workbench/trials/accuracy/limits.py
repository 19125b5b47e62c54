"""Limits of the accuracy trial."""

from __future__ import annotations

from workbench.model.limit import Limit
from workbench.trials.trial_step import ResultLimits


class AccuracyLimits(ResultLimits):
    """Limits on the mean error at every standoff, with guard bands, and on the test of the bias."""

    closest_error_mm: Limit | None = None
    closest_relative_error: Limit | None = None
    mean_error_mm: Limit | None = None
    mean_relative_error: Limit | None = None
    laser_error_mm: Limit | None = None
    laser_relative_error: Limit | None = None
    bias_p: Limit | None = None
