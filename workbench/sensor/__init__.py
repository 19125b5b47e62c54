"""A calibrated sensor: spot curves, ranges and their covariance."""
