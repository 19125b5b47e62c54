"""The accuracy trial: readings of a flat at standoffs that the fit did not see, and their errors."""

from workbench.trials.accuracy.step import AccuracyTrialStep

__all__ = ["AccuracyTrialStep"]
