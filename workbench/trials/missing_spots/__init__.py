"""Missing-spots trial: readings with lasers left off, compared with readings of all lasers."""

from workbench.trials.missing_spots.step import MissingSpotsTrialStep

__all__ = ["MissingSpotsTrialStep"]
