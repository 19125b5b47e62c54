"""Repeatability trial: repeats within placements, and re-placements, of a flat target (ISO 5725-2)."""

from workbench.trials.repeatability.step import RepeatabilityTrialStep

__all__ = ["RepeatabilityTrialStep"]
