"""Which terms of the model the data need: nested models compared.

A term is compared with its absence by the Bayes factor of the two nested models (J. M. Dickey and B. P.
Lientz, Ann. Math. Statist. 41 (1970) 214: posterior over prior density at the value that is absence), both
densities Gaussian, and by a chi-square test of the data alone. To leave a term out because nothing speaks for
it would be to claim that it is zero, and intervals would be too short (measured in docs/decisions/0005).
So a term goes where the data speak against it. A term of the lens goes as well where no range can tell the
difference; what its prior says of it then stays in the covariance of the others.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import log
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from workbench.calibration.fit import Fit
from workbench.calibration.parameters import LENS, RAY, REFERENCE, ParameterTable
from workbench.calibration.problem import Problem
from workbench.calibration.sensor import spot_gradients, spots
from workbench.calibration.term import Term
from workbench.model.calibration import TermVerdict
from workbench.model.nested import TILTS, hold
from workbench.model.rig import Prior, Rig

FloatArray = NDArray[np.float64]
STRONG = 1.0
"""log10 of a Bayes factor that is strong evidence (R. E. Kass and A. E. Raftery, JASA 90 (1995) 773)."""
IDLE_SHIFT_SD = 0.1
"""Ranges off by this much of their deviation lose 0.5 % of their accuracy."""
IDLE_SD = 0.02
"""Relative change of a range's deviation."""
CALLED_FOR_P = 0.001
TRIAL_SD = {"k1": 0.3, "k2": 0.3, "p1": 0.003, "p2": 0.003, "k3": 0.3}
"""Prior under which a term that the model lacks is tried."""
ORDERS = ("k1", "k2", "k3")
"""Of the radial polynomial: none is left out below one that stays."""
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


def choose(refit: Callable[[Rig], Fit], rig: Rig, keep: Sequence[str] = ()) -> Fit:
    """Fit with the terms that the data need; `terms` of the result has the evidence on each.

    Args:
        refit: the fit of the same data by a rig's priors.
        rig: the largest model. What it holds constant stays so, but is tried (`verdict` "called for").
        keep: names of terms that stay whatever the data say.
    """
    fitted = refit(rig)
    terms: list[Term] = []
    idle: list[str] = []
    stays = False
    for name in _candidates(fitted):
        index = _indices(fitted, name)
        comparison = _compare(fitted, index)
        shift, widening = _effect_on_ranges(fitted, index, comparison)
        verdict = _verdict(comparison.log10_bayes_factor, shift, widening, name)
        if name in keep:
            verdict = "asked for"
        if name in ORDERS and stays and verdict in LEFT_OUT:
            verdict = "below"
        stays = stays or (name in ORDERS and verdict not in LEFT_OUT)
        terms.append(Term(name, comparison.p_value, comparison.log10_bayes_factor, shift, verdict))
        if verdict == "absent":
            fitted = refit(hold(fitted.rig, name.split()))
        if verdict == "idle":
            idle += name.split()
    if idle:
        fitted = _without_idle(fitted, refit(hold(fitted.rig, idle)), idle)
    return replace(fitted, terms=(*terms, *_called_for(fitted, rig)))


def _candidates(fitted: Fit) -> list[str]:
    """Names of the terms of a fit, the first to go first."""
    names = {p.name for p in fitted.table.parameters if p.prior.sd > 0}
    tangential = " ".join(n for n in ("p1", "p2") if n in names)
    found = [n for n in ("k3", tangential, "k2", "k1", "ruler_scale") if n and n.split()[0] in names]
    return [*found, TILTS] if len(_indices(fitted, TILTS)) else found


def _indices(fitted: Fit, name: str) -> NDArray[np.intp]:
    """(T,) where a term's parameters stand among all."""
    if name != TILTS:
        wanted = {*name.split()}
        return np.flatnonzero([p.name in wanted for p in fitted.table.parameters])
    boards = {view.placement.key for view in fitted.boards}
    tilts = {
        f"{p.key}.{slope}"
        for p in fitted.cells.placements
        if p.key not in boards
        for slope in ("slope_x", "slope_y")
    }
    return np.flatnonzero([p.name in tilts and p.prior.sd > 0 for p in fitted.table.parameters])


def _compare(fitted: Fit, index: NDArray[np.intp]) -> _Comparison:
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
    return float(chdtrc(known.sum(), chi2)) if known.any() else 1.0


def _effect_on_ranges(fitted: Fit, index: NDArray[np.intp], comparison: _Comparison) -> tuple[float, float]:
    """Without a term: the largest shift of a range in its deviations, and the largest change of these.

    The deviation without it is of ranges whose covariance still carries the term's prior.
    """
    gradient, spot_sd = _range_gradients(fitted)
    with_sd = np.sqrt(np.einsum("np,pq,nq->n", gradient, fitted.covariance, gradient) + spot_sd**2)
    carried = _carried(fitted, index, comparison.follow)
    without_sd = np.sqrt(np.einsum("np,pq,nq->n", gradient, carried, gradient) + spot_sd**2)
    shift = np.abs(gradient @ comparison.change) / with_sd
    return float(shift.max(initial=0.0)), float(np.abs(without_sd / with_sd - 1).max(initial=0.0))


def _carried(fitted: Fit, index: NDArray[np.intp], follow: FloatArray) -> FloatArray:
    """(P, P) of an estimate that holds a term at its prior's mean while the truth is as its prior says.

    S. F. Schmidt's consider covariance (Advances in Control Systems 3 (1966) 293).
    """
    conditional = fitted.covariance - follow @ fitted.covariance[index]
    weighted = follow * fitted.table.prior_sd[index]
    return np.asarray(conditional + weighted @ weighted.T)


def _range_gradients(fitted: Fit) -> tuple[FloatArray, FloatArray]:
    """(n, P) of ranges by all parameters, and (n,) what a spot's noise adds, over lasers and standoffs."""
    lens, offset = fitted.values[: len(LENS)], len(LENS)
    standoffs = [s.standoff_mm for s in fitted.used]
    grid = np.geomspace(min(standoffs), max(standoffs), GRID)
    noise = fitted.rig.noise
    spot_px = np.hypot(noise.spot_sd_px, noise.speckle_sd_px) * fitted.noise_scale
    size = np.array([fitted.rig.camera.width_px, fitted.rig.camera.height_px])
    rows, sds = [], []
    for i, laser in enumerate(fitted.rig.lasers):
        start = len(LENS) + len(REFERENCE) + len(RAY) * i
        ray = fitted.values[start : start + len(RAY)]
        position = np.asarray(spots(lens, ray, 1.0 / (grid + fitted.values[offset])))
        by = [np.asarray(part) for part in spot_gradients(lens, ray, fitted.values[offset], grid)]
        axis = "uv".index(laser.axis)
        by_lens, by_ray, by_range = (part[:, axis] for part in by)
        gradient = np.zeros((GRID, len(fitted.values)))
        gradient[:, : len(LENS)] = -by_lens / by_range[:, None]
        gradient[:, start : start + len(RAY)] = -by_ray / by_range[:, None]
        gradient[:, offset] = -1.0
        seen = ((position >= 0) & (position <= size - 1)).all(axis=1)
        rows.append(gradient[seen])
        sds.append(np.abs(spot_px / by_range[seen]))
    return np.concatenate(rows), np.concatenate(sds)


def _verdict(log10_bayes_factor: float, shift: float, widening: float, name: str) -> TermVerdict:
    if log10_bayes_factor >= STRONG:
        return "shown"
    if log10_bayes_factor <= -STRONG:
        return "absent"
    return (
        "idle"
        if set(name.split()) <= set(LENS) and shift <= IDLE_SHIFT_SD and widening <= IDLE_SD
        else "open"
    )


def _without_idle(full: Fit, reduced: Fit, names: Sequence[str]) -> Fit:
    """The values of the reduced fit, in whose covariance the idle terms are still what their priors say."""
    index = np.flatnonzero([p.name in names for p in full.table.parameters])
    carried = _carried(full, index, _compare(full, index).follow)
    return replace(reduced, rig=full.rig, table=full.table, covariance=carried)


def _called_for(fitted: Fit, rig: Rig) -> list[Term]:
    """Terms of the lens that the rig file holds constant and the data call for (a score test)."""
    tried = [name for name in TRIAL_SD if getattr(rig.camera, name).sd == 0]
    parameters = tuple(
        replace(p, prior=Prior(value=p.prior.value, sd=TRIAL_SD[p.name])) if p.name in tried else p
        for p in fitted.table.parameters
    )
    table = ParameterTable(parameters)
    index = [i for i, p in enumerate(parameters) if p.name in tried]
    problem = Problem.of(len(rig.lasers), table, fitted.cells, fitted.boards, rig.board)
    sd = table.prior_sd
    offset = fitted.values - table.prior_mean
    y = np.divide(offset, sd, out=np.zeros_like(sd), where=sd > 0)
    residual, jacobian = problem.linearise(y, fitted.noise_scale)
    free = fitted.table.prior_sd > 0
    within = jacobian[:, free]
    covariance = np.linalg.inv(within.T @ within + np.eye(free.sum()))
    found = []
    for i in index:
        name, column = parameters[i].name, jacobian[:, i]
        along = within.T @ column
        information = column @ column - along @ covariance @ along
        score = -column @ residual
        p_value = float(chdtrc(1, score**2 / information)) if information > KNOWN else 1.0
        if p_value < CALLED_FOR_P:
            log_factor = 0.5 * (score**2 / (1 + information) - log(1 + information))
            found.append(Term(name, p_value, float(log_factor / log(10)), None, "called for"))
    return found
