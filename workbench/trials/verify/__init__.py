"""Verification of the calibration of a sensor in service."""

from workbench.trials.verify.step import VerifyTrialStep

__all__ = ["VerifyTrialStep"]
