"""Calibration: parameters and priors, fit, covariance, null directions, checks."""
