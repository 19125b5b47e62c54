"""Comparison of trials with the hardware tests of D. L. Tran's thesis (MIT, 2001), figures 33 to 42."""

from workbench.trials.thesis_hardware.step import ThesisComparisonStep

__all__ = ["ThesisComparisonStep"]
