"""Alternative explanations of the data, compared by approximate Bayes factor.

A hypothesis is the fit's problem with other data of the same shapes: two lasers exchanged, the image
mirrored, a standoff free, a spot left out. Its score is twice the logarithm of its Bayes factor against the
current explanation: the decrease of the cost minus the Occam factor. The cost is chi-square of data and
priors, in units of the remaining noise. The Occam factor is twice the logarithm of the prior range of the
free quantity over the width to which the data determine it. This is Laplace's approximation (D. J. C.
MacKay, Information Theory, Inference, and Learning Algorithms, 2003, chapter 28).

The search is greedy: the best hypothesis is adopted while it is decisive, and the next are compared with it
adopted. An early choice can be wrong once a later one is adopted. At the end each is therefore removed in
turn, and kept only where the rest without it is decisively worse.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import log, radians, tan

import numpy as np

from workbench.calibration.checks.cross_validation import (
    by_standoff,
    predictive,
    problem_at,
    range_error,
    rows_at,
)
from workbench.calibration.checks.hypothesis import DECISIVE, Hypothesis, from_priors, scored
from workbench.calibration.checks.mistaken_data import (
    exchanged_coordinates,
    exchanged_lasers,
    flipped_images,
    is_pulled,
    other_units,
)
from workbench.calibration.checks.priors import prior_strain
from workbench.calibration.estimation.fit import CalibrationFit
from workbench.calibration.estimation.problem import LeastSquaresProblem
from workbench.calibration.estimation.refit import Refit, measured, optimum_of, problem_of, refit, rows_of
from workbench.calibration.model.parameters import PLACEMENT
from workbench.model.arrays import BoolArray, FloatArray, IndexArray
from workbench.model.stats import chi2_sf, f_sf

IMPROBABLE = 1e-4
"""P value of a fit below which hypotheses other than single wrong spots are tried."""
FALSE_REJECTION = 1e-3
"""Probability that any spot of a sound fit is rejected."""
EXPLAINED = 0.9
"""Share of the excess misfit that the hypotheses found must explain together."""
TIE = 10.0
"""Difference of scores below which two hypotheses are not distinguished; the first in order is taken."""
STANDOFF_COST = 2 * log(5000 / 0.5)
"""Occam factor of a free standoff: some metres of prior range, determined to half a millimetre."""
SPOT_COST = 2 * 2 * log(500 / 0.05)
"""Occam factor of a wrong spot: anywhere in the image, determined to its deviation, in u and v."""
TILTED_SD = tan(radians(20.0))
"""Prior deviation of the slopes of a placement whose target is not square at all."""
FIRST_ORDER_SHARE = 0.5
"""Share of the necessary gain; below it, to first order, a fit that is not improbable is not refitted."""
MINIMA = 4
"""Local minima of the scan over standoffs that are refined."""
STEPS = 5
"""Gauss-Newton steps from each of them."""
SCAN_MM = np.geomspace(20.0, 50_000.0, 120)
SPARSE = 6
"""Stride through the scan for a board: its corners determine the distance, with a single wide minimum."""
MOST_REJECTED = 0.1
"""Largest share of outliers among all spots."""
FEWEST_SPOTS = 6
STUDENT_SQUARE = 9.0
"""Squared distance, in variances, at which a spot weighs half in the reweighted fit."""
START_WEIGHT = 1e-4
REWEIGHTINGS = 12
LEAST_NARROWING = 1e-9
"""Least relative decrease of a prior's variance for the data to constrain the parameter."""


def explain_misfit(fit: CalibrationFit) -> tuple[Hypothesis, ...]:
    """Hypotheses that together explain the misfit, in the order of adoption; none for a sound fit.

    Outliers (`spot`) and the unit of the standoffs are reported whether or not the rest is explained: the
    unit is compared at the noise of the residuals. All others are reported only where everything together
    explains EXPLAINED of the excess misfit.
    """
    problem = problem_of(fit)
    state = refit(problem, measured(problem), optimum_of(fit))
    excess = _excess(state)
    most = max(1, int(MOST_REJECTED * len(fit.cells.laser)))
    found: list[Hypothesis] = []
    while len(found) < most + 3:
        best = _best(list(_candidates(fit, state, first=not found)))
        if best is None or not best.significant:
            break
        found.append(best)
        state = best.state
    spots = tuple(h for h in found if h.kind == "spot")
    explained = _excess(state) <= (1 - EXPLAINED) * excess or not is_improbable(state)
    found = _needed(fit, state, found) if explained else [h for h in found if h.kind in {"spot", "unit"}]
    return tuple(found) if len(spots) <= most else tuple(h for h in found if h.kind != "spot")


def _needed(fit: CalibrationFit, state: Refit, found: list[Hypothesis]) -> list[Hypothesis]:
    """The hypotheses without which the rest explains decisively less."""
    latest = list({(h.kind, h.subject): h for h in found}.values())
    if len(latest) == 1:
        return latest
    return [replace(h, state=state) for h in latest if _is_needed(fit, state, h)]


def _is_needed(fit: CalibrationFit, state: Refit, h: Hypothesis) -> bool:
    problem, used = state.problem, state.used
    if h.kind == "standoff":
        problem = problem_at(problem, h.subject[0], fit.cells.placements[h.subject[0]].standoff_mm)
    elif h.kind == "spot":
        own = np.isin(np.arange(len(fit.cells.laser)), h.subject)
        used = used | (rows_of(own, problem) & measured(problem))
    else:
        return True
    without = from_priors(problem, used)
    rise = (without.cost - state.cost) / max(1.0, state.chi2 / max(state.freedom, 1.0))
    return rise > (DECISIVE if h.kind == "spot" else STANDOFF_COST + DECISIVE)


def is_improbable(state: Refit) -> bool:
    """Whether the cost of data and priors is significantly larger than its degrees of freedom."""
    return bool(chi2_sf(state.cost, state.used.sum()) < IMPROBABLE)


def _excess(state: Refit) -> float:
    """Cost above its expectation (one for each used row)."""
    return state.cost - float(state.used.sum())


def _best(candidates: list[Hypothesis]) -> Hypothesis | None:
    """The first candidate within TIE of the highest score; a significant one where there is any."""
    if not candidates:
        return None
    top = max(c.score for c in candidates)
    tied = [c for c in candidates if c.score >= top - TIE]
    return next((c for c in tied if c.significant), tied[0])


def _candidates(fit: CalibrationFit, state: Refit, first: bool) -> Iterator[Hypothesis]:
    improbable = is_improbable(state)
    if improbable and first:
        yield from flipped_images(fit, state)
        yield from exchanged_coordinates(fit, state)
        yield from exchanged_lasers(fit, state)
    if first and (improbable or is_pulled(fit, state)):
        yield from other_units(state)
    if improbable or first:
        yield from _wrong_standoffs(fit, state)
        yield from _tilted_targets(fit, state)
    yield from _wrong_spots(fit, state)


def _wrong_standoffs(fit: CalibrationFit, state: Refit) -> Iterator[Hypothesis]:
    """Standoffs of single placements free, the most strained first, until one explains everything.

    A placement is tried only where leaving it out gains more than the Occam factor of a free standoff. The
    noise of the many corners of a board alone gains as much; there the strain of its placement error is
    compared instead.
    """
    cost = STANDOFF_COST + 2 * log(len(fit.cells.placements))
    boards = {view.placement.key for view in fit.boards}
    strain = [
        _strain(state, np.array([_error_index(fit, index)])) for index in range(len(fit.cells.placements))
    ]
    sound = not is_improbable(state)
    for index in np.argsort(strain)[::-1].tolist():
        if fit.cells.placements[index].is_free:
            continue
        on_board = fit.cells.placements[index].key in boards
        rows = rows_at(state.problem, index) & state.used
        others = state.used & ~rows
        if not rows.any() or not others.any():
            continue
        if on_board and strain[index] < cost + DECISIVE:
            continue
        if sound and not on_board and _gain_without(state, rows) < FIRST_ORDER_SHARE * (cost + DECISIVE):
            continue
        reduced = from_priors(state.problem, others)
        if on_board or state.cost - reduced.cost > cost + DECISIVE:
            scan_mm = SCAN_MM[::SPARSE] if on_board else SCAN_MM
            standoff_mm = _likeliest_standoff(fit, reduced, rows, index, scan_mm)
            after = _refit_at(fit, state, reduced, index, standoff_mm)
            found = scored("standoff", (index,), state, after, cost)
            yield found
            if found.significant and not is_improbable(found.state):
                return


def _strain(state: Refit, index: IndexArray) -> float:
    """First-order decrease of the cost without the priors of some parameters."""
    return prior_strain(state.y[index], state.covariance[np.ix_(index, index)], LEAST_NARROWING).chi2


def _gain_without(state: Refit, rows: BoolArray) -> float:
    """First-order decrease of the cost without some rows: r^T (1 - J C J^T)^-1 r."""
    own = state.jacobian[rows]
    free = np.eye(len(own)) - own @ state.covariance @ own.T
    return float(state.residual[rows] @ np.linalg.solve(free, state.residual[rows]))


def _refit_at(fit: CalibrationFit, state: Refit, reduced: Refit, index: int, standoff_mm: float) -> Refit:
    """Refit of all used rows with a placement at its likeliest standoff.

    The second refit moves the standoff by the placement error of the first, so that a free standoff costs
    nothing in the prior of that error.
    """
    problem = problem_at(reduced.problem, index, standoff_mm)
    found = refit(problem, state.used, reduced.y)
    error_mm = (fit.table.prior_mean + fit.table.prior_sd * found.y)[_error_index(fit, index)]
    return refit(problem_at(problem, index, standoff_mm + float(error_mm)), state.used, found.y)


def _likeliest_standoff(
    fit: CalibrationFit, reduced: Refit, rows: BoolArray, index: int, scan_mm: FloatArray
) -> float:
    """Standoff of a placement with the highest predictive likelihood of its rows, by the fit without it.

    The likelihood has several maxima (spots of other lasers lie where those of this one could), so it is
    scanned, and the MINIMA lowest minima of the deviance are refined.
    """

    def deviance(standoff_mm: float) -> float:
        return float(np.nan_to_num(_deviance(_with_standoff(reduced, index, standoff_mm), rows), nan=np.inf))

    scanned = np.array([deviance(mm) for mm in scan_mm])
    low = [n for n in range(1, len(scanned) - 1) if scanned[n] <= min(scanned[n - 1], scanned[n + 1])]
    lowest = sorted(low, key=lambda n: float(scanned[n]))[:MINIMA]
    starts = [fit.cells.placements[index].standoff_mm, *scan_mm[lowest].tolist()]
    return min((_refine_standoff(reduced, rows, index, start) for start in starts), key=deviance)


def _refine_standoff(reduced: Refit, rows: BoolArray, index: int, standoff_mm: float) -> float:
    """Gauss-Newton steps of the standoff, each limited to 30 %: the scan is coarser than the spots' noise."""
    for _ in range(STEPS):
        there = _with_standoff(reduced, index, standoff_mm)
        limit_mm = 0.3 * standoff_mm
        standoff_mm += float(np.clip(range_error(there, rows, by_standoff(there))[0], -limit_mm, limit_mm))
    return standoff_mm


def _with_standoff(reduced: Refit, index: int, standoff_mm: float) -> Refit:
    """The refit, with another standoff of a placement that it does not use."""
    return reduced.with_unused(problem_at(reduced.problem, index, standoff_mm))


def _deviance(reduced: Refit, rows: BoolArray) -> float:
    """Minus twice the log predictive density of rows that the refit does not use, up to a constant."""
    distance, variance = reduced.residual[rows], predictive(reduced, rows)
    return float(distance @ np.linalg.solve(variance, distance) + np.linalg.slogdet(variance)[1])


def _error_index(fit: CalibrationFit, index: int) -> int:
    return [p.name for p in fit.table.parameters].index(f"{fit.cells.placements[index].key}.error_mm")


def _tilted_targets(fit: CalibrationFit, state: Refit) -> Iterator[Hypothesis]:
    """The placement whose slopes are the most improbable, turned about the vertical or the horizontal.

    The Occam factor is that of two Gaussian models that differ in a prior: the change of the log determinant
    of the information, in units of the priors.
    """
    boards = {view.placement.key for view in fit.boards}
    flat = [n for n, info in enumerate(fit.cells.placements) if info.key not in boards]
    slopes = {n: s for n in flat if len(s := slope_indices(fit, n))}
    if not slopes:
        return
    index = max(slopes, key=lambda n: _strain(state, slopes[n]))
    cost = 2 * log(2 * len(slopes))
    if _strain(state, slopes[index]) < FIRST_ORDER_SHARE * (cost + DECISIVE):
        return
    for slope in slopes[index].tolist():
        sd = np.array(state.problem.data.sd, float)
        sd[slope] = max(sd[slope], TILTED_SD)
        problem = LeastSquaresProblem(state.problem.layout, state.problem.data._replace(sd=sd))
        after = from_priors(problem, state.used)
        narrowed = np.linalg.slogdet(state.covariance)[1] - np.linalg.slogdet(after.covariance)[1]
        yield scored("tilted", (index, slope), state, after, cost + float(narrowed))


def slope_indices(fit: CalibrationFit, index: int) -> IndexArray:
    """Indices of the free slopes of a placement among the parameters."""
    key = fit.cells.placements[index].key
    names = {f"{key}.{name}" for name in PLACEMENT[1:]}
    return np.flatnonzero([p.name in names and p.prior.sd > 0 for p in fit.table.parameters])


def _wrong_spots(fit: CalibrationFit, state: Refit) -> Iterator[Hypothesis]:
    """The spot farthest from its prediction by all others, left out.

    In an improbable fit outliers may mask one another: the farthest spot of a robust fit is tried too.
    """
    count = len(fit.cells.laser)
    if count < FEWEST_SPOTS:
        return
    states = [state, *([_reweighted(state, count)] if is_improbable(state) else [])]
    distances = [_deletion_distances(one, count) for one in states]
    for cell in sorted({int(np.argmax(distance)) for distance in distances if distance.any()}):
        yield _without_spot(state, cell, count)


def _deletion_distances(state: Refit, count: int) -> FloatArray:
    """(count,) squared distance of each spot from its prediction by all others, to first order."""
    own = state.jacobian[: 2 * count]
    spread = own @ state.covariance
    distance = np.zeros(count)
    for cell in range(count):
        rows = np.flatnonzero(state.used[2 * cell : 2 * cell + 2]) + 2 * cell
        free = np.eye(len(rows)) - spread[rows] @ own[rows].T
        distance[cell] = state.residual[rows] @ np.linalg.solve(free, state.residual[rows])
    return distance


def _reweighted(state: Refit, count: int) -> Refit:
    """Robust fit from the priors: iteratively reweighted least squares with Cauchy weights.

    A spot at squared distance d^2 (in variances) weighs 1 / (1 + d^2 / 9).
    """
    problem, y = state.problem, np.zeros_like(state.y)
    inverse_sd = np.asarray(problem.data.inverse_sd)
    weight = np.full(len(inverse_sd), START_WEIGHT)
    for _ in range(REWEIGHTINGS):
        data = problem.data._replace(inverse_sd=inverse_sd * np.sqrt(weight)[:, None])
        y = refit(LeastSquaresProblem(problem.layout, data), state.used, y).y
        residual, jacobian = problem.linearise(y)
        square = (np.where(state.used, residual, 0.0).reshape(-1, 2) ** 2).sum(axis=1)
        weight[:count] = 1.0 / (1.0 + square[:count] / STUDENT_SQUARE)
    return Refit(problem, state.used, y, 1.0, residual, jacobian)


def _without_spot(state: Refit, cell: int, count: int) -> Hypothesis:
    """A spot left out, with the test of outliers: chi-square, or F where the noise is estimated.

    The rate FALSE_REJECTION is divided among all spots (Bonferroni).
    """
    used = np.array(state.used)
    used[2 * cell : 2 * cell + 2] = False
    after = from_priors(state.problem, used) if is_improbable(state) else refit(state.problem, used, state.y)
    freedom, degrees = max(after.freedom, 1.0), int(state.used.sum() - used.sum())
    gain = state.cost - after.cost
    noise = max(1.0, after.chi2 / freedom)
    chance = f_sf(gain / degrees / noise, degrees, freedom) if noise > 1 else chi2_sf(gain, degrees)
    significant = bool(chance < FALSE_REJECTION / count)
    return Hypothesis("spot", (cell,), after, gain / noise - SPOT_COST, significant)
