"""Bounds for tests on many trials, and the covariance of least squares."""

from __future__ import annotations

import numpy as np

from workbench.model.arrays import FloatArray


def spread(probability: float, n: int) -> float:
    """Four standard deviations of a share of n trials."""
    return float(4 * np.sqrt(probability * (1 - probability) / n))


def inverse_of_information(jac: object) -> FloatArray:
    """(p, p) covariance of least squares with the Jacobian (n, p) of normalised residuals."""
    j = np.asarray(jac, np.float64)
    return np.asarray(np.linalg.inv(j.T @ j), np.float64)
