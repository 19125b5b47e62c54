"""Other ways in which the data may have come about, and how much better each explains them.

A hypothesis is the fit's problem with other numbers of the same shapes: two lasers exchanged, the picture
mirrored, a standoff free, a spot left out. It is refitted, and its score is by how much the misfit of data
and priors falls, less what a hypothesis with that much freedom would gain for nothing: twice the logarithm of
the room that it has over the width at which the data fix it (the Occam factor; D. J. C. MacKay, Information
Theory, Inference, and Learning Algorithms, 2003, chapter 28).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from math import log
from typing import Literal

import numpy as np

from workbench.calibration.checks.cross_validation import by_standoff, predictive, range_error, rows_at
from workbench.calibration.estimation.fit import CalibrationFit
from workbench.calibration.estimation.problem import LeastSquaresProblem
from workbench.calibration.estimation.refit import Refit, measured, optimum_of, problem_of, refit, rows_of
from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.stats import chi2_sf, f_sf

Kind = Literal["lasers_swapped", "mirrored", "upside_down", "turned", "standoff", "spot"]
IMPROBABLE = 1e-4
"""Data less likely than this make the search look further than at single spots."""
FALSE_REJECTION = 1e-3
"""Of one sound fit: the chance that any of its spots is rejected."""
DECISIVE = 15.0
"""Score from which a hypothesis is believed: odds of 1800 to 1."""
EXPLAINED = 0.9
"""Of the excess misfit, for what was found to count as its explanation."""
TIE = 10.0
"""Scores that differ by less do not tell two hypotheses apart: the first in order stands for both."""
STANDOFF_COST = 2 * log(5000 / 0.5)
"""Some metres in which a mistyped standoff may lie, over the half millimetre to which spots fix it."""
SPOT_COST = 2 * 2 * log(500 / 0.05)
"""The picture in which a wrong spot may lie, over its deviation, for u and v."""
CLEARLY_LESS = 0.5
"""Of what it takes: where first order says so of a fit that is not improbable, no refit is made."""
MINIMA = 4
STEPS = 5
SCAN_MM = np.geomspace(20.0, 50_000.0, 120)
SPARSE = 6
"""Of the scan, where a board's corners tell the distance: no other standoff lies as near to fitting them."""
MOST_REJECTED = 0.1
"""Of all spots: more than that are no outliers."""
FEWEST_SPOTS = 6
STUDENT_SQUARE = 9.0
"""Squared distance, in variances, at which a spot weighs half when spots are reweighted."""
START_WEIGHT = 1e-4
REWEIGHTINGS = 12
UNTOLD = 1e-9
"""Share of a prior's variance by which data narrow it; with less they say nothing of it."""


@dataclass(frozen=True)
class Hypothesis:
    """One that has been refitted."""

    kind: Kind
    subject: tuple[int, ...]
    """Lasers exchanged; the placement; or the cell."""
    state: Refit
    score: float
    significant: bool


def explain_misfit(fit: CalibrationFit) -> tuple[Hypothesis, ...]:
    """The hypotheses, best first, that together explain what the fit does not; none where it is sound.

    Spots that lie apart are found whether or not everything else is explained; anything else counts only
    where the whole explains EXPLAINED of the excess misfit.
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
    found = _needed(fit, state, found) if explained else list(spots)
    return tuple(found) if len(spots) <= most else tuple(h for h in found if h.kind != "spot")


def _needed(fit: CalibrationFit, state: Refit, found: list[Hypothesis]) -> list[Hypothesis]:
    """Those without which the rest explains decisively less: what came first may be a mistake."""
    latest = list({(h.kind, h.subject): h for h in found}.values())
    if len(latest) == 1:
        return latest
    return [replace(h, state=state) for h in latest if _is_needed(fit, state, h)]


def _is_needed(fit: CalibrationFit, state: Refit, h: Hypothesis) -> bool:
    problem, used = state.problem, state.used
    if h.kind == "standoff":
        problem = _problem_at(problem, h.subject[0], fit.cells.placements[h.subject[0]].standoff_mm)
    elif h.kind == "spot":
        mine = np.isin(np.arange(len(fit.cells.laser)), h.subject)
        used = used | (rows_of(mine, problem) & measured(problem))
    else:
        return True
    without = _from_priors(problem, used)
    rise = (without.cost - state.cost) / max(1.0, state.chi2 / max(state.freedom, 1.0))
    return rise > (DECISIVE if h.kind == "spot" else STANDOFF_COST + DECISIVE)


def is_improbable(state: Refit) -> bool:
    """Whether data and priors together fit worse than by chance."""
    return bool(chi2_sf(state.cost, state.used.sum()) < IMPROBABLE)


def _excess(state: Refit) -> float:
    return max(state.cost - float(state.used.sum()), 0.0)


def _best(candidates: list[Hypothesis]) -> Hypothesis | None:
    if not candidates:
        return None
    top = max(c.score for c in candidates)
    return next(c for c in candidates if c.score >= top - TIE and c.significant >= _any(candidates, top))


def _any(candidates: list[Hypothesis], top: float) -> bool:
    return any(c.significant for c in candidates if c.score >= top - TIE)


def _candidates(fit: CalibrationFit, state: Refit, first: bool) -> Iterator[Hypothesis]:
    improbable = is_improbable(state)
    if improbable and first:
        yield from _pictures(fit, state)
        yield from _swaps(fit, state)
    if improbable or first:
        yield from _standoffs(fit, state)
    yield from _spots(fit, state)


def _scored(kind: Kind, subject: tuple[int, ...], before: Refit, after: Refit, cost: float) -> Hypothesis:
    noise = max(1.0, after.chi2 / max(after.freedom, 1.0))
    score = (before.cost - after.cost) / noise - cost
    return Hypothesis(kind, subject, after, score, score > DECISIVE)


def _pictures(fit: CalibrationFit, state: Refit) -> Iterator[Hypothesis]:
    """The picture left for right, top for bottom, both."""
    data = state.problem.data
    edge = np.array([fit.rig.camera.width_px - 1.0, fit.rig.camera.height_px - 1.0])
    turns: tuple[tuple[Kind, tuple[bool, bool]], ...] = (
        ("mirrored", (True, False)),
        ("upside_down", (False, True)),
        ("turned", (True, True)),
    )
    for kind, axes in turns:
        position = np.where(axes, edge - data.position_px, data.position_px)
        problem = LeastSquaresProblem(state.problem.layout, data._replace(position_px=position))
        yield _scored(kind, (), state, _from_priors(problem, state.used), 2 * log(3))


def _swaps(fit: CalibrationFit, state: Refit) -> Iterator[Hypothesis]:
    data = state.problem.data
    pairs = list(combinations(range(len(fit.rig.lasers)), 2))
    laser = np.asarray(data.spots.laser)
    for a, b in pairs:
        swapped = np.where(laser == a, b, np.where(laser == b, a, laser))
        spots = data.spots._replace(laser=swapped)
        problem = LeastSquaresProblem(state.problem.layout, data._replace(spots=spots))
        after = _from_priors(problem, state.used)
        yield _scored("lasers_swapped", (a, b), state, after, 2 * log(len(pairs)))


def _from_priors(problem: LeastSquaresProblem, used: BoolArray) -> Refit:
    """An optimum that wrong data may have led far astray is no place to start from."""
    return refit(problem, used, np.zeros(len(np.asarray(problem.data.mean))))


def _standoffs(fit: CalibrationFit, state: Refit) -> Iterator[Hypothesis]:
    """Placements' standoffs free, the most strained first, until one explains everything.

    The rest must be better off without the placement by what a free standoff takes.
    """
    cost = STANDOFF_COST + 2 * log(len(fit.cells.placements))
    boards = {view.placement.key for view in fit.boards}
    strain = [_strain(fit, state, index) for index in range(len(fit.cells.placements))]
    sound = not is_improbable(state)
    for index in np.argsort(strain)[::-1].tolist():
        on_board = fit.cells.placements[index].key in boards
        rows = rows_at(state.problem, index) & state.used
        others = state.used & ~rows
        if not rows.any() or not others.any():
            continue
        # The noise of a board's corners would pass for a gain: there, what the standoff costs is the measure.
        if on_board and strain[index] < cost + DECISIVE:
            continue
        if sound and not on_board and _gain_without(state, rows) < CLEARLY_LESS * (cost + DECISIVE):
            continue
        left = _from_priors(state.problem, others)
        if on_board or state.cost - left.cost > cost + DECISIVE:
            at_mm = _where_it_stood(fit, left, rows, index, SCAN_MM[::SPARSE] if on_board else SCAN_MM)
            found = _scored("standoff", (index,), state, _freed(fit, state, left, index, at_mm), cost)
            yield found
            if found.significant and not is_improbable(found.state):
                return


def _strain(fit: CalibrationFit, state: Refit, index: int) -> float:
    """By how much the cost falls if a placement's error needs no prior, to first order."""
    error = _error_index(fit, index)
    told = 1.0 - state.covariance[error, error]
    return float(state.y[error] ** 2 / told) if told > UNTOLD else 0.0


def _gain_without(state: Refit, rows: BoolArray) -> float:
    """By how much the cost falls without some rows, to first order."""
    own = state.jacobian[rows]
    free = np.eye(len(own)) - own @ state.covariance @ own.T
    return float(state.residual[rows] @ np.linalg.solve(free, state.residual[rows]))


def _freed(fit: CalibrationFit, state: Refit, left: Refit, index: int, at_mm: float) -> Refit:
    """The state with the placement where its spots say that it stood."""
    problem = _problem_at(left.problem, index, at_mm)
    found = refit(problem, state.used, left.y)
    # Once more with the sensor that all of them make: a standoff with no error of its own costs nothing.
    error = (fit.table.prior_mean + fit.table.prior_sd * found.y)[_error_index(fit, index)]
    return refit(_problem_at(problem, index, at_mm + float(error)), state.used, found.y)


def _where_it_stood(
    fit: CalibrationFit, left: Refit, rows: BoolArray, index: int, scan_mm: FloatArray
) -> float:
    """The standoff that the rest finds likeliest for what was seen of a placement."""
    scanned = np.nan_to_num([_surprise(_stands(left, index, mm), rows) for mm in scan_mm], nan=np.inf)
    low = [n for n in range(1, len(scanned) - 1) if scanned[n] <= min(scanned[n - 1], scanned[n + 1])]
    lowest = sorted(low, key=lambda n: float(scanned[n]))[:MINIMA]
    starts = [fit.cells.placements[index].standoff_mm, *scan_mm[lowest].tolist()]
    refined = [_nearby(left, rows, index, start) for start in starts]
    return min(
        refined, key=lambda mm: float(np.nan_to_num(_surprise(_stands(left, index, mm), rows), nan=np.inf))
    )


def _nearby(left: Refit, rows: BoolArray, index: int, at_mm: float) -> float:
    """A standoff made better step by step; the scan's own steps are wider than what spots tell apart."""
    for _ in range(STEPS):
        there = _stands(left, index, at_mm)
        at_mm += float(np.clip(range_error(there, rows, by_standoff(there))[0], -0.3 * at_mm, 0.3 * at_mm))
    return at_mm


def _stands(left: Refit, index: int, standoff_mm: float) -> Refit:
    """The refit as it is, looking at a placement that stands elsewhere."""
    return left.with_unused(_problem_at(left.problem, index, standoff_mm))


def _problem_at(problem: LeastSquaresProblem, index: int, standoff_mm: float) -> LeastSquaresProblem:
    standoff = np.array(problem.data.standoff_mm, float)
    standoff[index] = standoff_mm
    return LeastSquaresProblem(problem.layout, problem.data._replace(standoff_mm=standoff))


def _surprise(left: Refit, rows: BoolArray) -> float:
    """Minus twice the log probability of rows that the refit has not used, but for a constant."""
    distance, variance = left.residual[rows], predictive(left, rows)
    return float(distance @ np.linalg.solve(variance, distance) + np.linalg.slogdet(variance)[1])


def _error_index(fit: CalibrationFit, index: int) -> int:
    return [p.name for p in fit.table.parameters].index(f"{fit.cells.placements[index].key}.error_mm")


def _spots(fit: CalibrationFit, state: Refit) -> Iterator[Hypothesis]:
    """The spots that lie farthest from where all others put them, each left out."""
    count = len(fit.cells.laser)
    if count < FEWEST_SPOTS:
        return
    looks = [state]
    if is_improbable(state):  # a fit that outliers have drawn to themselves no longer shows them
        looks.append(_reweighted(state, count))
    apart = [_apart(look, count) for look in looks]
    for cell in sorted({int(np.argmax(distance)) for distance in apart if distance.any()}):
        yield _without_spot(state, cell, count)


def _apart(state: Refit, count: int) -> FloatArray:
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
    """A fit that outliers do not draw to themselves: spots weighed by Cauchy's law, from the priors."""
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
    used = np.array(state.used)
    used[2 * cell : 2 * cell + 2] = False
    after = _from_priors(state.problem, used) if is_improbable(state) else refit(state.problem, used, state.y)
    freedom, degrees = max(after.freedom, 1.0), int(state.used.sum() - used.sum())
    gain = state.cost - after.cost
    noise = max(1.0, after.chi2 / freedom)
    chance = f_sf(gain / degrees / noise, degrees, freedom) if noise > 1 else chi2_sf(gain, degrees)
    significant = bool(chance < FALSE_REJECTION / count)
    return Hypothesis("spot", (cell,), after, gain / noise - SPOT_COST, significant)
