"""Incline trial: readings of a flat target at set angles, and the errors of range and angle."""

from workbench.trials.incline.step import InclineTrialStep

__all__ = ["InclineTrialStep"]
