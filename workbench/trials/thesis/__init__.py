"""The thesis's simulation: its scenes, its own chain, the workbench's chain, and what the thesis claims."""

from workbench.trials.thesis.step import ThesisSimulationStep

__all__ = ["ThesisSimulationStep"]
