"""Gauge R&R trial: operators place a flat target at every standoff several times (AIAG MSA)."""

from workbench.trials.gauge_rr.step import GaugeTrialStep

__all__ = ["GaugeTrialStep"]
