"""One alternative explanation of the data: its refit and its score against the current explanation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from workbench.calibration.estimation.problem import LeastSquaresProblem
from workbench.calibration.estimation.refit import Refit, refit
from workbench.model.arrays import BoolArray

HypothesisKind = Literal[
    "lasers_swapped", "mirrored", "upside_down", "turned", "transposed", "unit", "standoff", "tilted", "spot"
]
DECISIVE = 15.0
"""Score from which a hypothesis is adopted: exp(15 / 2), odds of 1800 to 1."""


@dataclass(frozen=True)
class Hypothesis:
    """A refitted hypothesis."""

    kind: HypothesisKind
    subject: tuple[int, ...]
    """Indices of the two lasers, of the placement (and its slope), or of the cell."""
    state: Refit
    """The refit with this and all earlier hypotheses adopted."""
    score: float
    significant: bool


def scored(
    kind: HypothesisKind, subject: tuple[int, ...], before: Refit, after: Refit, cost: float
) -> Hypothesis:
    """The hypothesis with its score.

    Args:
        kind: kind of the hypothesis.
        subject: see `Hypothesis.subject`.
        before: refit of the current explanation.
        after: refit of the hypothesis.
        cost: its Occam factor.
    """
    noise = max(1.0, after.chi2 / max(after.freedom, 1.0))
    score = (before.cost - after.cost) / noise - cost
    return Hypothesis(kind, subject, after, score, score > DECISIVE)


def from_priors(problem: LeastSquaresProblem, used: BoolArray) -> Refit:
    """Refit from the prior means: wrong data may have drawn the current optimum into another minimum."""
    return refit(problem, used, np.zeros(len(np.asarray(problem.data.mean))))
