"""Priors that the data contradict.

In units of the priors and of the noise, data with derivatives J have the covariance 1 + J J^T before anything
is measured. The posterior means y = C J^T r then have the covariance 1 - C, where C = (1 + J^T J)^-1 is their
posterior covariance. So y^T (1 - C)^-1 y is chi-square, with one degree of freedom for each direction that
the data constrain.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from workbench.calibration.estimation.fit import CalibrationFit
from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.stats import chi2_sf, norm_cdf

CONTRADICTION_SD = 5.0
"""Distance from its prior at which a parameter refuses the fit; 1 in 2 million lies so far by chance."""
DOUBT_P = 0.005
"""Probability that the priors of a sound fit raise a warning, one by one; the same for all together."""
LEAST_NARROWING = 0.1
"""Least relative decrease of a prior's variance by the data for its pull to be tested. Where the data hardly
constrain a combination, the curvature of the model moves it more than their noise does."""


class PriorStrain(NamedTuple):
    """Squared distance of parameters from their priors."""

    chi2: float
    freedom: int
    """Number of directions that the data constrain."""


def prior_strain(y: FloatArray, covariance: FloatArray, least_narrowing: float) -> PriorStrain:
    """Strain of n parameters by their priors: y^T (1 - C)^-1 y.

    Args:
        y: (n,) posterior means in units of the priors, counted from their means.
        covariance: (n, n) posterior covariance in these units.
        least_narrowing: relative decrease of the variance below which a direction counts as unconstrained.
    """
    values, vectors = np.linalg.eigh(np.eye(len(y)) - covariance)
    seen = values > least_narrowing
    return PriorStrain(float(((vectors.T @ y)[seen] ** 2 / values[seen]).sum()), int(seen.sum()))


def contradicted_priors(fit: CalibrationFit) -> list[str]:
    """Reasons of refusal: parameters far from their priors, by a wrong rig file or a mistyped standoff."""
    return [
        f"{_prior_text(fit, n)}. Do: check this prior, and the standoffs"
        for n in np.flatnonzero((np.abs(fit.prior_pull) > CONTRADICTION_SD) & ~_is_drift(fit)).tolist()
    ]


def doubted_priors(fit: CalibrationFit) -> list[str]:
    """Warnings: priors of the sensor that the data move improbably far, one by one and all together."""
    free = np.flatnonzero(fit.table.is_sensor & (fit.table.prior_sd > 0) & ~_is_drift(fit))
    sd = fit.table.prior_sd[free]
    y, covariance = fit.prior_pull[free], fit.covariance[np.ix_(free, free)] / np.outer(sd, sd)
    narrowing = 1.0 - np.diag(covariance)
    tested = narrowing > LEAST_NARROWING
    z = np.where(tested, np.abs(y) / np.sqrt(np.where(tested, narrowing, 1.0)), 0.0)
    p = len(free) * 2.0 * norm_cdf(-z)
    order = np.argsort(-z)
    doubted = [int(free[n]) for n in order if p[n] < DOUBT_P]
    if doubted:
        return [f"{_prior_text(fit, n)}. Check this value in the rig file." for n in doubted]
    together = prior_strain(y, covariance, LEAST_NARROWING)
    if not (together.freedom and chi2_sf(together.chi2, together.freedom) < DOUBT_P):
        return []
    largest = ", ".join(fit.table.parameters[free[n]].name for n in order[:3])
    return [
        f"the priors of the rig file together contradict the data (chi2 {together.chi2:.0f}, expected"
        f" {together.freedom}); {largest} move most. Check these values in the rig file."
    ]


def _is_drift(fit: CalibrationFit) -> BoolArray:
    """(P,) whether each parameter is a drift of the image, or its step between two parts.

    They have a limit; their prior is no measurement.
    """
    drift = np.zeros(len(fit.values), bool)
    drift[fit.layout.drift] = drift[fit.layout.steps] = True
    return drift


def _prior_text(fit: CalibrationFit, index: int) -> str:
    p, pull = fit.table.parameters[index], abs(fit.prior_pull[index])
    return (
        f"{p.name} = {fit.values[index]:.5g} {p.unit} lies {pull:.1f} sd from its prior in the rig file"
        f" ({p.prior.value:g} +- {p.prior.sd:g} {p.unit})"
    )
