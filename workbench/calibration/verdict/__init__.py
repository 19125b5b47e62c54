"""What a fit amounts to: assessment, null directions, the calibration file."""
