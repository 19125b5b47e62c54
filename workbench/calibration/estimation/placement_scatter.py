"""Scale of the placement errors where they are significantly larger than stated.

Residuals cannot show that, because each placement has a parameter that absorbs its error. The fitted errors
do. In units of the stated deviation the J errors e have the prior N(0, 1). The data, with every other
parameter marginalised, give them the information L = C^-1 - 1 (C: their posterior covariance) and the
information vector n = C^-1 y (y: their posterior means). If the true variances are D, n has the covariance
L + L D L. In the eigenvectors of L, with eigenvalues l, each component a then obeys

    a^2 / l  ~  (1 + s^2 l) chi-square(1)        where all variances are s^2.

The test weighs each component by l / (1 + l), the score of s^2 at 1 (C. R. Rao, Proc. Camb. Phil. Soc. 44
(1948) 50), and approximates the sum by a scaled chi-square of the same mean and variance (F. E.
Satterthwaite, Biometrics Bull. 2 (1946) 110). The scale is the maximum of the likelihood. One or two
placements far from their standoff are no scatter: where that explains the errors better, the scale is that
of the others.
"""

from __future__ import annotations

from math import inf
from typing import NamedTuple

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.model.stats import chi2_sf

LEAST_INFORMATION = 1e-3
"""Information on a combination of placement errors, in units of its prior's, below which it is ignored."""
LARGEST_SCALE = 100.0
SCALED_P = 0.1
"""P value below which the deviations are scaled: a scale that was not needed costs less than one that was."""
OUTLIER_SD = 30.0
"""Prior deviation of a placement at a wrong standoff, in stated deviations."""
MOST_OUTLIERS = 2
FEWEST = 3
"""Placements from whose errors a scale is estimated."""


class PlacementScatter(NamedTuple):
    """Scatter of the placement errors of one fit, and their outliers."""

    scale: float
    """Factor on the stated deviations; 1 where the errors agree with them."""
    p_value: float
    """Chance of errors as large, of all but the outliers; 1 where the data show none, or fewer than FEWEST
    placements are left."""
    outliers: tuple[int, ...]
    """Indices, among the J placements, of those at a wrong standoff."""
    degrees_of_freedom: float = inf
    """Of the estimated variance; infinite where the deviations are as stated."""


def placement_scatter(errors: FloatArray, covariance: FloatArray) -> PlacementScatter:
    """Compare fitted placement errors with their stated deviation.

    Args:
        errors: (J,) posterior means, in stated deviations.
        covariance: (J, J) their posterior covariance in the same unit.
    """
    if len(errors) < FEWEST:
        return PlacementScatter(1.0, 1.0, ())
    seen = _Seen.of(errors, covariance)
    variance = np.ones(len(errors))
    outliers: list[int] = []
    p = _p_value(seen, variance)
    while p < SCALED_P and len(outliers) < MOST_OUTLIERS:
        scaled = _log_likelihood(seen, np.where(variance > 1, variance, _variance(seen, variance)))
        tried = [
            _log_likelihood(seen, np.where(np.arange(len(errors)) == n, OUTLIER_SD**2, variance))
            for n in range(len(errors))
        ]
        best = int(np.argmax(tried))
        if variance[best] > 1 or tried[best] - np.log(len(errors)) < scaled:
            break
        outliers.append(best)
        variance[best] = OUTLIER_SD**2
        p = _p_value(seen, variance)
    if len(errors) - len(outliers) < FEWEST:
        return PlacementScatter(1.0, 1.0, tuple(outliers))
    if p < SCALED_P:
        found = _variance(seen, variance)
        freedom = _degrees_of_freedom(seen, variance, found)
        return PlacementScatter(float(np.sqrt(found)), p, tuple(outliers), freedom)
    return PlacementScatter(1.0, p, tuple(outliers))


class _Seen(NamedTuple):
    """The information on J placement errors, in the K eigenvectors that carry any."""

    component: FloatArray
    """(K,) of the information vector, over the root of its eigenvalue."""
    root: FloatArray
    """(K, J) eigenvectors times the root of their eigenvalue: R R^T is the diagonal of eigenvalues."""

    @classmethod
    def of(cls, errors: FloatArray, covariance: FloatArray) -> _Seen:
        precision = np.linalg.inv(covariance)
        values, vectors = np.linalg.eigh(precision - np.eye(len(errors)))
        kept = values > LEAST_INFORMATION
        size = np.sqrt(values[kept])
        along = vectors[:, kept].T
        return cls(along @ (precision @ errors) / size, size[:, None] * along)


def _covariance(seen: _Seen, variance: FloatArray) -> FloatArray:
    """(K, K) of `component` where the errors have these variances (J,)."""
    return np.asarray(np.eye(len(seen.root)) + (seen.root * variance) @ seen.root.T)


def _log_likelihood(seen: _Seen, variance: FloatArray) -> float:
    covariance = _covariance(seen, variance)
    square = seen.component @ np.linalg.solve(covariance, seen.component)
    return -0.5 * float(square + np.linalg.slogdet(covariance)[1])


def _variance(seen: _Seen, variance: FloatArray) -> float:
    """The variance that those of value 1 have most likely, at least 1."""
    from scipy.optimize import minimize_scalar  # a tenth of the time of a fit to load; few fits need it

    def misfit(log_scale: float) -> float:
        return -_log_likelihood(seen, np.where(variance > 1, variance, np.exp(2.0 * log_scale)))

    found = minimize_scalar(misfit, bounds=(0.0, np.log(LARGEST_SCALE)), method="bounded")
    return float(np.exp(2.0 * found.x))


def _degrees_of_freedom(seen: _Seen, variance: FloatArray, estimate: float) -> float:
    """2 / (relative variance of the estimated variance), by its Fisher information at the estimate."""
    common = variance == 1.0
    covariance = _covariance(seen, np.where(common, estimate, variance))
    added = estimate * seen.root[:, common] @ seen.root[:, common].T
    share = np.linalg.solve(covariance, added)
    return float(np.trace(share @ share))


def _p_value(seen: _Seen, variance: FloatArray) -> float:
    """Of errors as large as these or larger, by the score of a common scale of those of variance 1."""
    if not len(seen.component):
        return 1.0
    covariance = _covariance(seen, variance)
    # Score of the scale: z^T B z, with z the whitened components and B what a larger scale adds to them.
    inverse_root = np.linalg.inv(np.linalg.cholesky(covariance))
    added = inverse_root @ seen.root[:, variance == 1.0]
    weight = added @ added.T
    z = inverse_root @ seen.component
    mean, square = float(np.trace(weight)), float((weight**2).sum())
    if mean < LEAST_INFORMATION:
        return 1.0
    return float(chi2_sf(z @ weight @ z / (square / mean), mean**2 / square))
