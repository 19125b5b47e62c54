"""Verdict on a fit: assessment, null directions, the calibration file, comparison."""
