"""Which terms of the model the data need: nested models compared.

A term is compared with its absence by the Bayes factor of the two nested models (J. M. Dickey and B. P.
Lientz, Ann. Math. Statist. 41 (1970) 214: posterior over prior density at the value that is absence), both
densities Gaussian, and by a chi-square test of the data alone. To leave a term out because nothing speaks for
it would be to claim that it is zero, and intervals would be too short (measured in docs/decisions/0005).
So a term goes where the data speak against it. A term of the lens goes as well where no range can tell the
difference; what its prior says of it then stays in the covariance of the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import log
from typing import NamedTuple

import numpy as np

from workbench.calibration.data.boards import BoardView
from workbench.calibration.data.observations import Observation, Rejected
from workbench.calibration.estimation.fit import CalibrationFit, fit, fit_cells, table_of
from workbench.calibration.estimation.problem import LeastSquaresProblem
from workbench.calibration.model.term import Term
from workbench.calibration.selection.outliers import fit_without_outliers, without_outliers
from workbench.model.arrays import FloatArray, IndexArray
from workbench.model.calibration import TermVerdict
from workbench.model.errors import BadInputError
from workbench.model.nested import TILTS, fix_parameters
from workbench.model.rig import Prior, Rig
from workbench.model.stats import chi2_sf
from workbench.optics.lens_models import lens_model

STRONG = 1.0
"""log10 of a Bayes factor that is strong evidence (R. E. Kass and A. E. Raftery, JASA 90 (1995) 773)."""
IDLE_SHIFT_SD = 0.1
"""Ranges off by this much of their deviation lose 0.5 % of their accuracy."""
IDLE_SD = 0.02
"""Relative change of a range's deviation."""
CALLED_FOR_P = 0.001
LEFT_OUT = ("absent", "idle")
GRID = 12
KNOWN = 1e-6
"""Information of the data, in units of the prior's, below which they know nothing of a direction."""


class _Comparison(NamedTuple):
    """With a term of T parameters against without it."""

    p_value: float
    log10_bayes_factor: float
    follow: FloatArray
    """(P, T) how all parameters move with the term's."""
    change: FloatArray
    """(P,) of all parameters when the term goes."""


def fit_chosen(
    rig: Rig,
    observations: Sequence[Observation],
    rejected: Sequence[Rejected] = (),
    boards: Sequence[BoardView] = (),
    keep: Sequence[str] = (),
) -> CalibrationFit:
    """As `fit`, without spots that lie apart, and with the terms of the model that the data need.

    `terms` of the result has the evidence on each. An idle one is still in the fit: `without_idle` is what is
    exported.

    Args:
        rig: the largest model. What it holds constant stays so, but is tried (`verdict` "called for").
        observations: as for `fit`.
        rejected: as for `fit`.
        boards: as for `fit`.
        keep: names of terms that stay whatever the data say.

    Raises:
        BadInputError: as `fit`, or the model has no such term.
        LimitFailedError: as `fit`.
    """
    # Asked before anything is rejected: the spots that the model lacks a term for look like wrong ones.
    whole = fit(rig, observations, rejected, boards)
    missing = _called_for(whole)
    freed = _freed(rig, [t.name for t in missing])
    sound = (
        fit_without_outliers(freed, observations, rejected, boards)
        if missing
        else without_outliers(whole, rejected)
    )

    def refit(model: Rig) -> CalibrationFit:
        return fit_cells(model, sound.cells, sound.rejected, boards)

    fitted = refit(rig) if missing else sound
    if fitted is not whole:
        missing = _called_for(fitted)
    _check_names(fitted, keep)
    terms: list[Term] = []
    idle: list[str] = []
    orders = fitted.layout.model.radial_orders
    for name in _candidates(fitted):
        term = _weigh(fitted, name, idle, any(t.name in orders and t.verdict not in LEFT_OUT for t in terms))
        if not {name, *name.split()}.isdisjoint(keep):
            term = replace(term, verdict="asked for")
        terms.append(term)
        if term.verdict == "absent":
            fitted = refit(fix_parameters(fitted.rig, name.split()))
        if term.verdict == "idle":
            idle.append(name)
    return replace(fitted, terms=(*terms, *missing))


def without_idle(fitted: CalibrationFit) -> CalibrationFit:
    """The estimate with its idle terms at their priors' means, as it is exported.

    Values and covariance alone differ, to first order: no range is to tell the difference. The covariance is
    of the estimate's errors; it is no posterior.
    """
    idle = [t.name for t in fitted.terms if t.verdict == "idle"]
    if not idle:
        return fitted
    index = _indices(fitted, idle)
    comparison = _compare(fitted, index)
    values = fitted.values + comparison.change
    values[index] = fitted.table.prior_mean[index]
    return replace(fitted, values=values, covariance=_carried(fitted, index, comparison.follow))


def _weigh(fitted: CalibrationFit, name: str, idle: Sequence[str], higher_stays: bool) -> Term:
    """A term against its absence; idle only if it is so together with those that are already."""
    one = _compare(fitted, _indices(fitted, [name]))
    shift, _ = _effect_on_ranges(fitted, _indices(fitted, [name]))
    verdict: TermVerdict = "open"
    if one.log10_bayes_factor >= STRONG:
        verdict = "shown"
    elif name in fitted.layout.model.radial_orders and higher_stays:
        verdict = "below"
    elif one.log10_bayes_factor <= -STRONG:
        verdict = "absent"
    elif set(name.split()) <= set(fitted.layout.model.parameters):
        together, widening = _effect_on_ranges(fitted, _indices(fitted, [*idle, name]))
        verdict = "idle" if together <= IDLE_SHIFT_SD and widening <= IDLE_SD else "open"
    return Term(name, one.p_value, one.log10_bayes_factor, shift, verdict)


def _check_names(fitted: CalibrationFit, keep: Sequence[str]) -> None:
    known = _candidates(fitted)
    if unknown := [name for name in keep if name not in {*known, *" ".join(known).split()}]:
        raise BadInputError(
            f"--keep {unknown[0]}: expected a term of the model that may be left out, one of"
            f" {', '.join(known) or 'none: the rig file holds them all constant'}"
        )


def _freed(rig: Rig, names: Sequence[str]) -> Rig:
    """The rig with terms of the lens made free, at the scale at which they are tried."""
    known, trial_sd = rig.camera.lens_priors, lens_model(rig.camera.lens).trial_sd
    priors = {name: Prior(value=known[name].value, sd=trial_sd[name]) for name in names}
    return rig.model_copy(update={"camera": rig.camera.model_copy(update=priors)})


def _candidates(fitted: CalibrationFit) -> list[str]:
    """Names of the terms of a fit, the first to go first."""
    names = {p.name for p in fitted.table.parameters if p.prior.sd > 0}
    orders = (*fitted.layout.model.removal_order, "ruler_scale")
    found = [there for term in orders if (there := " ".join(n for n in term.split() if n in names))]
    return [*found, TILTS] if len(_indices(fitted, [TILTS])) else found


def _indices(fitted: CalibrationFit, names: Sequence[str]) -> IndexArray:
    """(T,) where the parameters of terms stand among all."""
    wanted = set(" ".join(names).split())
    if TILTS in wanted:
        boards = {view.placement.key for view in fitted.boards}
        flat = [p.key for p in fitted.cells.placements if p.key not in boards]
        wanted |= {f"{key}.{slope}" for key in flat for slope in ("slope_x", "slope_y")}
    return np.flatnonzero([p.name in wanted and p.prior.sd > 0 for p in fitted.table.parameters])


def _compare(fitted: CalibrationFit, index: IndexArray) -> _Comparison:
    prior_sd = fitted.table.prior_sd[index]
    offset = fitted.values[index] - fitted.table.prior_mean[index]
    posterior = fitted.covariance[np.ix_(index, index)]
    follow = np.asarray(np.linalg.solve(posterior, fitted.covariance[index]).T, float)
    y, covariance = offset / prior_sd, posterior / np.outer(prior_sd, prior_sd)
    precision = np.linalg.inv(covariance)
    log_factor = 0.5 * (y @ precision @ y + np.linalg.slogdet(covariance)[1])
    return _Comparison(
        p_value=_p_value(precision @ y, precision - np.eye(len(y))),
        log10_bayes_factor=float(log_factor / log(10)),
        follow=follow,
        change=-follow @ offset,
    )


def _p_value(score: FloatArray, information: FloatArray) -> float:
    """Of a score by its information, both from the data alone."""
    values, vectors = np.linalg.eigh(information)
    known = values > KNOWN
    chi2 = ((vectors.T @ score)[known] ** 2 / values[known]).sum()
    return float(chi2_sf(chi2, known.sum())) if known.any() else 1.0


def _effect_on_ranges(fitted: CalibrationFit, index: IndexArray) -> tuple[float, float]:
    """Without a term: the largest shift of a range in its deviations, and the largest change of these.

    The deviation without it is of ranges whose covariance still carries the term's prior.
    """
    comparison = _compare(fitted, index)
    gradient, own_sd = _range_gradients(fitted)
    with_sd = np.sqrt(np.einsum("np,pq,nq->n", gradient, fitted.covariance, gradient) + own_sd**2)
    carried = _carried(fitted, index, comparison.follow)
    without_sd = np.sqrt(np.einsum("np,pq,nq->n", gradient, carried, gradient) + own_sd**2)
    shift = np.abs(gradient @ comparison.change) / with_sd
    return float(shift.max(initial=0.0)), float(np.abs(without_sd / with_sd - 1).max(initial=0.0))


def _carried(fitted: CalibrationFit, index: IndexArray, follow: FloatArray) -> FloatArray:
    """(P, P) of an estimate that holds a term at its prior's mean while the truth is as its prior says.

    S. F. Schmidt's consider covariance (Advances in Control Systems 3 (1966) 293).
    """
    conditional = fitted.covariance - follow @ fitted.covariance[index]
    weighted = follow * fitted.table.prior_sd[index]
    return np.asarray(conditional + weighted @ weighted.T)


def _range_gradients(fitted: CalibrationFit) -> tuple[FloatArray, FloatArray]:
    """(n, P) of ln(range) by all parameters, and (n,) what a spot's noise adds, over lasers and standoffs."""
    standoffs = [s.standoff_mm for s in fitted.used]
    grid = np.geomspace(min(standoffs), max(standoffs), GRID)
    noise = fitted.rig.noise
    spot_px = float(np.hypot(noise.spot_sd_px, noise.speckle_sd_px)) * fitted.noise_scale
    laser = np.repeat(np.arange(len(fitted.rig.lasers)), GRID)
    range_mm = np.tile(grid, len(fitted.rig.lasers))
    layout = fitted.layout
    w = 1.0 / (range_mm + fitted.values[layout.offset])
    spots = fitted.curves.spots(laser, w)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # of spots that no picture shows
        found = fitted.curves.invert(laser, spots, np.full(spots.shape, 1.0 / spot_px))
    gradient = np.zeros((len(laser), len(fitted.values)))
    own = np.array([layout.own(n) for n in range(layout.lasers)])
    gradient[np.arange(len(laser))[:, None], own[laser]] = found.dz
    gradient[:, layout.offset] = -1.0
    size = np.array([fitted.rig.camera.width_px, fitted.rig.camera.height_px])
    seen = ((spots > -0.5) & (spots < size - 0.5)).all(axis=1) & np.isfinite(found.z_sd_of_spot_mm)
    return gradient[seen] / range_mm[seen, None], found.z_sd_of_spot_mm[seen] / range_mm[seen]


def _called_for(fitted: CalibrationFit) -> list[Term]:
    """Terms of the lens that the rig file holds constant and the data call for (a score test)."""
    rig = fitted.rig
    tried = [name for name in fitted.layout.model.trial_sd if rig.camera.lens_priors[name].sd == 0]
    table = table_of(_freed(rig, tried), fitted.cells.placements, fitted.boards)
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
        score = -column @ residual
        p_value = float(chi2_sf(score**2 / information, 1)) if information > KNOWN else 1.0
        if p_value < CALLED_FOR_P:
            log_factor = 0.5 * (score**2 / (1 + information) - log(1 + information))
            found.append(Term(name, p_value, float(log_factor / log(10)), None, "called for"))
    return found
