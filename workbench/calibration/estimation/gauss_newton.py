"""Gauss-Newton iteration for small least-squares problems outside hot loops.

`problem` solves the fit with optimistix. `refit` and `batch` have damped solvers of their own for speed. The
loops in `sensor`, `optics`, `corners` and `ranging` solve many problems at once or are compiled.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from workbench.model.arrays import FloatArray

Linearise = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""From parameters (P,) to residuals (M,) and their derivatives (M, P)."""


def gauss_newton(linearise: Linearise, start: FloatArray, steps: int) -> FloatArray:
    """Minimise a sum of squares by a fixed number of undamped steps.

    Each step is the least-squares solution of minimum norm, so that a parameter without any effect stays at
    its start.

    Args:
        linearise: residuals and derivatives at a point. Weights may depend on the point; each step then uses
            those of its own point (iteratively reweighted least squares).
        start: (P,) near enough to the optimum for undamped steps.
        steps: number of steps, each one evaluation of `linearise`.

    Returns:
        (P,) the parameters after the last step.

    Raises:
        numpy.linalg.LinAlgError: residuals or derivatives are not finite.
    """
    x = np.array(start, float)
    for _ in range(steps):
        residual, jacobian = linearise(x)
        x = x - np.linalg.lstsq(jacobian, residual, rcond=None)[0]
    return x
