"""Constant lens terms that the data call for."""

from __future__ import annotations

from collections.abc import Sequence
from math import log

import numpy as np

from workbench.calibration.estimation.fit import CalibrationFit, table_of
from workbench.calibration.estimation.problem import LeastSquaresProblem
from workbench.model.calibration import TermSummary
from workbench.model.prior import Prior
from workbench.model.rig import Rig
from workbench.model.stats import chi2_sf
from workbench.optics.lens_models import lens_model

CALLED_FOR_P = 0.001
"""P value below which the data call for a term that the rig file holds constant."""
LEAST_INFORMATION = 1e-6
"""Information of the data, in units of the prior's, below which they do not constrain a direction."""


def freed(rig: Rig, names: Sequence[str]) -> Rig:
    """The rig with constant lens terms free, with the lens model's trial deviations as priors."""
    known, trial_sd = rig.camera.lens_priors, lens_model(rig.camera.lens).trial_sd
    priors = {name: Prior(value=known[name].value, sd=trial_sd[name]) for name in names}
    return rig.model_copy(update={"camera": rig.camera.model_copy(update=priors)})


def missing_terms(fitted: CalibrationFit) -> list[TermSummary]:
    """Constant lens terms that the data call for, by a score test at the fit.

    Let j be the derivatives of the residuals r by the term, J those by the free parameters, C their posterior
    covariance. The information on the term is `j j - j^T J C J^T j`, the score `-j r`.
    """
    rig = fitted.rig
    tried = [name for name in fitted.layout.model.trial_sd if rig.camera.lens_priors[name].sd == 0]
    table = table_of(freed(rig, tried), fitted.cells.placements, fitted.boards, fitted.layout.parts)
    problem = LeastSquaresProblem.of(rig, table, fitted.cells, fitted.boards)
    sd = table.prior_sd
    y = np.divide(fitted.values - table.prior_mean, sd, out=np.zeros_like(sd), where=sd > 0)
    residual, jacobian = problem.linearise(y, fitted.noise_scale)
    free = fitted.table.prior_sd > 0
    within = jacobian[:, free]
    covariance = np.linalg.inv(within.T @ within + np.eye(free.sum()))
    found = []
    for name in tried:
        column = jacobian[:, [p.name for p in table.parameters].index(name)]
        along = within.T @ column
        information = column @ column - along @ covariance @ along
        if information <= LEAST_INFORMATION:
            continue
        score = -column @ residual
        p_value = float(chi2_sf(score**2 / information, 1))
        if p_value < CALLED_FOR_P:
            log_factor = 0.5 * (score**2 / (1 + information) - log(1 + information))
            found.append(
                TermSummary(
                    name=name,
                    verdict="called for",
                    p_value=p_value,
                    log10_bayes_factor=float(log_factor / log(10)),
                    range_shift_sd=None,
                )
            )
    return found
