"""Verdict of the accuracy trial: agreement with the stated uncertainty, and the decision against limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from workbench.model.number_text import probability
from workbench.trials.accuracy.agreement import Agreement
from workbench.trials.accuracy.completeness import Completeness
from workbench.trials.accuracy.limits import AccuracyLimits
from workbench.trials.accuracy.ranges import CLOSEST, MEAN
from workbench.trials.limits import Result, decision_on, skipped_results
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
    unmeasured: str = ""
    """Planned ranges that were not measured; empty if all were."""
    has_exact_standoffs: bool = False
    """Whether no uncertainty of a standoff is stated, neither at a placement nor in the rig file."""

    @property
    def is_biased(self) -> bool:
        """Whether the errors exceed the stated uncertainty."""
        return self.probability < BIAS_ALARM

    @property
    def text(self) -> str:
        """Verdict in one line."""
        agreement = "errors exceed" if self.is_biased else "errors agree with"
        decided = "" if self.decision is None else f"{self.decision.upper()}: "
        incomplete = f"; {self.unmeasured}" if self.unmeasured else ""
        exact = "; standoffs count as exact: state bench.placement_sd_mm" if self.has_exact_standoffs else ""
        notes = f"({probability(self.probability)}){incomplete}{exact}"
        return f"{decided}{agreement} the stated uncertainty {notes}"


def verdict_of(ranges: Sequence[Agreement], limits: AccuracyLimits, done: Completeness) -> Verdict:
    """Verdict on the ranges of one sensor, at least one."""
    results = [*results_of(ranges, limits, done), *skipped_results(done.skipped, limits)]
    exact = any(placed.reference.standoff_sd_mm == 0 for one in ranges for placed in one.placements)
    return Verdict(decision_on(results, limits), bias_probability(ranges), done.text, exact)


def bias_probability(ranges: Sequence[Agreement]) -> float:
    """P value of the largest bias of any range (Bonferroni); ranges of one sensor are not independent."""
    return joint_probability([one.bias.probability for one in ranges])


def joint_probability(probabilities: Sequence[float]) -> float:
    """P value of the smallest of several, at least one (Bonferroni)."""
    return min(1.0, len(probabilities) * min(probabilities))


def results_of(ranges: Sequence[Agreement], limits: AccuracyLimits, done: Completeness) -> list[Result]:
    """Results of all ranges that the limits apply to; an expected range without a reading has no value."""
    found = [result for one in ranges for result in error_results(one)]
    found += [
        result for name in dict.fromkeys(one.name for one in done.lost) for result in lost_results(name, done)
    ]
    if limits.bias_p is not None:
        found.append(Result("bias_p", "all ranges", bias_probability(ranges)))
    return found


def range_decision(
    name: str, one: Agreement | None, limits: AccuracyLimits, done: Completeness
) -> Decision | None:
    """Decision on one range; None without a limit on it.

    Args:
        name: name of the range.
        one: its agreement; None: no reading has this range.
        limits: limits of the step.
        done: what was not measured.
    """
    own = [*([] if one is None else error_results(one)), *lost_results(name, done)]
    quantities = {result.quantity for result in own}
    skipped = [one for one in skipped_results(done.skipped, limits) if one.quantity in quantities]
    return decision_on([*own, *skipped], limits)


def error_results(one: Agreement) -> list[Result]:
    """Mean error of one range at each placement, in mm and relative to the true range."""
    found = []
    for placed, error_mm, known in zip(one.placements, one.errors_mm.tolist(), one.uncertainty, strict=True):
        of, true_mm = _subject(one.name, placed.reference.standoff_mm), placed.true_mm
        in_mm, relative = _quantities(one.name)
        found += [
            Result.of_error(in_mm, of, error_mm, known.expanded),
            Result.of_error(relative, of, error_mm / true_mm, known.expanded / true_mm),
        ]
    return found


def lost_results(name: str, done: Completeness) -> list[Result]:
    """Results without a value of one range, where it was expected and no reading has it."""
    return [
        Result(quantity, _subject(name, one.standoff_mm), None)
        for one in done.lost_of(name)
        for quantity in _quantities(name)
    ]


def _quantities(name: str) -> tuple[str, str]:
    """Limits that apply to a range: of its error in mm, and relative."""
    kind = name if name in (CLOSEST, MEAN) else LASER
    return f"{kind}_error_mm", f"{kind}_relative_error"


def _subject(name: str, standoff_mm: float) -> str:
    return f"{name} at {standoff_mm:.6g} mm"
