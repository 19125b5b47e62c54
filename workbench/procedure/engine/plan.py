"""What a plan amounts to before it runs: its steps, how often the target is placed, and how many shots."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import singledispatch

from workbench.model import procedure as pr
from workbench.model.procedure import Procedure
from workbench.model.rig import Rig
from workbench.procedure.steps import shots


@dataclass(frozen=True)
class PlannedStep:
    """One step of a procedure."""

    procedure: str
    index: int
    title: str
    placements: int
    shots: int
    guess_s: float = 10.0
    """Where it takes no shots, and no session has told."""


@singledispatch
def placements(step: object) -> int:
    """How many times a step has the target placed: 0 but for steps that say otherwise."""
    return 0


@placements.register
def _(step: pr.CaptureGridStep) -> int:
    return len(step.standoffs_mm)


@placements.register
def _(step: pr.CaptureBoardStep) -> int:
    return len(step.placings)


@placements.register
def _(step: pr.AccuracyTrialStep) -> int:
    return len(step.standoffs_mm)


@placements.register
def _(step: pr.PlaceTargetStep) -> int:
    return 1


@singledispatch
def guess_s(step: object) -> float:
    """How long a step without shots may take where no session has told: computing, as a rule."""
    return 10.0


@guess_s.register
def _(step: pr.MessageStep) -> float:
    return 0.0


@guess_s.register
def _(step: pr.ConfirmStep | pr.AskStep) -> float:
    return 30.0


@guess_s.register
def _(step: pr.ExportStep | pr.CheckLimitsStep | pr.ValidateStep) -> float:
    return 1.0


@guess_s.register
def _(step: pr.WarmUpStep) -> float:
    return 0.1 * step.frames  # 30 frames a second, two of three too old


def outline(procedures: Sequence[Procedure], rig: Rig) -> list[PlannedStep]:
    """Every step of every procedure, in order."""
    return [
        PlannedStep(procedure.procedure, index, step.title, placements(step), shots(step, rig), guess_s(step))
        for procedure in procedures
        for index, step in enumerate(procedure.steps, start=1)
    ]
