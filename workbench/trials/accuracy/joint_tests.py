"""Tests of the error budget of all ranges together, with one alarm level for all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from workbench.trials.accuracy.agreement import Agreement
from workbench.trials.accuracy.ranges import CLOSEST

BUDGET_ALARM = 0.05
"""Largest probability of any alarm in the budget of a trial whose sources are complete."""


@dataclass(frozen=True)
class JointTest:
    """Test of one range over all standoffs."""

    name: str
    """Name of the range."""
    note: str
    """`all standoffs`: mean errors against all sources; `repeats`: their scatter against the noise."""
    ratio: float
    """Observed / explained variance."""
    probability: float
    """Probability of a larger ratio if the sources are complete."""
    level: float
    """Probability below which it is an alarm: `BUDGET_ALARM` shared by all tests (Bonferroni)."""

    @property
    def alarm(self) -> bool:
        """Whether the sources do not explain the errors."""
        return self.probability < self.level


def joint_tests(ranges: Sequence[Agreement]) -> list[JointTest]:
    """Tests of every range; not of the closest range's scatter, which has that of the selected shape too."""
    found = [
        (one.name, "all standoffs", one.bias.chi2 / one.bias.degrees_of_freedom, one.bias.probability)
        for one in ranges
    ]
    found += [
        (one.name, "repeats", one.repeats.ratio, one.repeats.probability)
        for one in ranges
        if one.repeats is not None and one.name != CLOSEST
    ]
    return [JointTest(*one, BUDGET_ALARM / len(found)) for one in found]
