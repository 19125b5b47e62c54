"""Verification of a sensor in service: is its calibration still valid?"""

from workbench.trials.verify.step import VerifyTrialStep

__all__ = ["VerifyTrialStep"]
