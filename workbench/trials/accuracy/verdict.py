"""Verdict of the accuracy trial: agreement with the stated uncertainty, and the decision against limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from workbench.trials.accuracy.agreement import Agreement
from workbench.trials.accuracy.limits import AccuracyLimits
from workbench.trials.accuracy.ranges import CLOSEST, MEAN
from workbench.trials.limits import Result, decision_on
from workbench.trials.statistics.decision import Decision

BIAS_ALARM = 0.05
"""Largest probability that a sensor without bias is called biased, of all its ranges together."""
LASER = "laser"


@dataclass(frozen=True)
class Verdict:
    """Verdict on all ranges of the sensor."""

    decision: Decision | None
    """Against the limits of the step; None without limits."""
    probability: float
    """P value of the largest bias of any range, over all standoffs (Bonferroni)."""

    @property
    def is_biased(self) -> bool:
        """Whether the errors exceed the stated uncertainty."""
        return self.probability < BIAS_ALARM

    @property
    def text(self) -> str:
        """Verdict in one line."""
        agreement = "errors exceed" if self.is_biased else "errors agree with"
        decided = "" if self.decision is None else f"{self.decision.upper()}: "
        return f"{decided}{agreement} the stated uncertainty (p = {self.probability:.2g})"


def verdict_of(ranges: Sequence[Agreement], limits: AccuracyLimits) -> Verdict:
    """Verdict on the ranges of one sensor, at least one."""
    return Verdict(decision_on(results_of(ranges, limits), limits), bias_probability(ranges))


def bias_probability(ranges: Sequence[Agreement]) -> float:
    """P value of the largest bias of any range (Bonferroni); ranges of one sensor are not independent."""
    return joint_probability([one.bias.probability for one in ranges])


def joint_probability(probabilities: Sequence[float]) -> float:
    """P value of the smallest of several, at least one (Bonferroni)."""
    return min(1.0, len(probabilities) * min(probabilities))


def results_of(ranges: Sequence[Agreement], limits: AccuracyLimits) -> list[Result]:
    """Results of all ranges that the limits apply to."""
    found = [result for one in ranges for result in error_results(one)]
    if limits.bias_p is not None:
        found.append(Result("bias_p", "all ranges", bias_probability(ranges)))
    return found


def error_results(one: Agreement) -> list[Result]:
    """Mean error of one range at each placement, in mm and relative to the true range."""
    kind = one.name if one.name in (CLOSEST, MEAN) else LASER
    found = []
    for placed, error_mm, known in zip(one.placements, one.errors_mm.tolist(), one.uncertainty, strict=True):
        of = f"{one.name} at {placed.reference.standoff_mm:.6g} mm"
        true_mm = placed.true_mm
        found += [
            Result.of_error(f"{kind}_error_mm", of, error_mm, known.expanded),
            Result.of_error(f"{kind}_relative_error", of, error_mm / true_mm, known.expanded / true_mm),
        ]
    return found
