"""Calibration of a scanning head: parameters with their priors, prediction, fit, and its file."""
