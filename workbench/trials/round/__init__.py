"""Round trial: readings of a cylinder, and the errors of range and radius."""

from workbench.trials.round.step import RoundTrialStep

__all__ = ["RoundTrialStep"]
