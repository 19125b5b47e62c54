"""Hypotheses about all of the data: image flipped, columns or lasers exchanged, standoffs in another unit."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from math import log

import numpy as np

from workbench.calibration.checks.hypothesis import Hypothesis, HypothesisKind, from_priors, scored
from workbench.calibration.estimation.fit import CalibrationFit
from workbench.calibration.estimation.problem import LeastSquaresProblem
from workbench.calibration.estimation.refit import Refit, measured, optimum_of, problem_of, refit

UNITS = {"centimetres": 10.0, "inches": 25.4, "metres": 1000.0}
"""Units that a ruler may have been read in, mm."""
UNIT_LIKELY = 6.0
"""Score from which a unit of all standoffs is adopted. Centimetres are a usual mistake, and cost no more than
a factor of 3: odds of 20 to 1 are enough. By Markov's inequality at most 1 in 20 sound fits scores as much;
by chance alone it takes a prior that is wrong by three of its deviations."""
UNIT_POSSIBLE = -2.0
"""Score from which a unit is possible: the data do not decide, at odds of less than 3 to 1 against it. Such
priors are too wide to distinguish a long focal length and baseline from standoffs in centimetres."""
PULLED_SD = 2.0
"""Distance of a parameter of the sensor from its prior, in its deviations, below which no unit could score
UNIT_LIKELY."""
UNIT_COST = 2 * log(len(UNITS))
"""Occam factor of the unit of all standoffs."""


def flipped_images(fit: CalibrationFit, state: Refit) -> Iterator[Hypothesis]:
    """The image mirrored left to right, top to bottom, both."""
    data = state.problem.data
    edge = np.array([fit.rig.camera.width_px - 1.0, fit.rig.camera.height_px - 1.0])
    turns: tuple[tuple[HypothesisKind, tuple[bool, bool]], ...] = (
        ("mirrored", (True, False)),
        ("upside_down", (False, True)),
        ("turned", (True, True)),
    )
    for kind, axes in turns:
        position = np.where(axes, edge - data.position_px, data.position_px)
        problem = LeastSquaresProblem(state.problem.layout, data._replace(position_px=position))
        yield scored(kind, (), state, from_priors(problem, state.used), 2 * log(3))


def exchanged_coordinates(fit: CalibrationFit, state: Refit) -> Iterator[Hypothesis]:
    """The columns u and v exchanged, for data that state positions: boards come from images."""
    if fit.boards:
        return
    data = state.problem.data
    position, inverse_sd = np.asarray(data.position_px)[:, ::-1], np.asarray(data.inverse_sd)[:, ::-1]
    problem = LeastSquaresProblem(
        state.problem.layout, data._replace(position_px=position, inverse_sd=inverse_sd)
    )
    used = state.used.reshape(-1, 2)[:, ::-1].ravel()
    yield scored("transposed", (), state, from_priors(problem, used), 2 * log(2))


def other_units(state: Refit) -> Iterator[Hypothesis]:
    """All standoffs read in another unit than millimetres; the subject is the index of the unit.

    The pull of the priors distinguishes the units. It is compared at the noise that the residuals have
    with that unit: their excess over the stated noise, which no unit explains, must not count against it. No
    parameter is added, but the data determine other combinations: the log determinants of the covariances
    belong to the evidence.
    """
    data = state.problem.data
    for index, unit_mm in enumerate(UNITS.values()):
        in_unit = data._replace(standoff_mm=unit_mm * np.asarray(data.standoff_mm))
        after = from_priors(LeastSquaresProblem(state.problem.layout, in_unit), state.used)
        noise = max(1.0, after.chi2 / max(after.freedom, 1.0)) ** 0.5
        before, scaled = (state.at(noise), after.at(noise)) if noise > 1 else (state, after)
        wider = np.linalg.slogdet(scaled.covariance)[1] - np.linalg.slogdet(before.covariance)[1]
        score = before.cost - scaled.cost + float(wider) - UNIT_COST
        yield Hypothesis("unit", (index,), after, score, score > UNIT_LIKELY)


def undecided_unit(fit: CalibrationFit) -> str | None:
    """Unit of the standoffs that is about as probable as millimetres by the priors; None if there is none."""
    problem = problem_of(fit)
    state = refit(problem, measured(problem), optimum_of(fit))
    if not is_pulled(fit, state):
        return None
    best = max(other_units(state), key=lambda h: h.score)
    return list(UNITS)[best.subject[0]] if best.score > UNIT_POSSIBLE else None


def is_pulled(fit: CalibrationFit, state: Refit) -> bool:
    """Whether a parameter of the sensor is so far from its prior that a unit could be the cause."""
    return bool(np.abs(state.y[fit.table.is_sensor]).max() > PULLED_SD)


def exchanged_lasers(fit: CalibrationFit, state: Refit) -> Iterator[Hypothesis]:
    """Every pair of lasers exchanged."""
    data = state.problem.data
    pairs = list(combinations(range(len(fit.rig.lasers)), 2))
    laser = np.asarray(data.spots.laser)
    for a, b in pairs:
        swapped = np.where(laser == a, b, np.where(laser == b, a, laser))
        spots = data.spots._replace(laser=swapped)
        problem = LeastSquaresProblem(state.problem.layout, data._replace(spots=spots))
        after = from_priors(problem, state.used)
        yield scored("lasers_swapped", (a, b), state, after, 2 * log(len(pairs)))
