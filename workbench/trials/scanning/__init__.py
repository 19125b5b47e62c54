"""Scanning head: its calibration on a flat, and the shape of a target from a scan."""

from workbench.trials.scanning.calibrate_step import CalibrateHeadStep
from workbench.trials.scanning.scan_step import ScanStep
from workbench.trials.scanning.use_step import UseHeadStep

__all__ = ["CalibrateHeadStep", "ScanStep", "UseHeadStep"]
