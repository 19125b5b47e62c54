"""Simulation of the thesis: scenes, the thesis's chain, the workbench's chain, and the thesis's claims."""

from workbench.trials.thesis.step import ThesisSimulationStep

__all__ = ["ThesisSimulationStep"]
