"""Accuracy trial: readings of a flat target at standoffs that the fit has not used, and their errors."""

from workbench.trials.accuracy.step import AccuracyTrialStep

__all__ = ["AccuracyTrialStep"]
