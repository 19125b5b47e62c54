"""Set-up of the incline trial: a target at a range."""

from __future__ import annotations

from dataclasses import dataclass

from workbench.model.target import Placement
from workbench.trials.targets import InclineSpec


@dataclass(frozen=True)
class SetUp:
    """One target at one range."""

    target: InclineSpec
    range_mm: float
    """Closest range asked for."""
    placement: Placement
