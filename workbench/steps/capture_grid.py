"""Step `capture_grid`: capture each laser alone at each standoff."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from workbench.model.event import StandoffAdvised
from workbench.model.fields import Count, Standoffs, require_different
from workbench.model.number_text import counted
from workbench.model.prompt import Prompt
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.procedure.capture.quality import CaptureLimits
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.lasers import capture_lasers
from workbench.procedure.engine.limits import capture_limit_prompts, check_captures
from workbench.procedure.engine.placements import visit_placements
from workbench.procedure.engine.plan import takes_added
from workbench.procedure.engine.prompts import placement_prompts, standoff_prompt
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.standoff_check import check_standoff
from workbench.procedure.engine.step import Step, StepModel, flat_placement
from workbench.procedure.engine.visiting_order import RETURN_AT, returned, shuffled
from workbench.steps.fit import FitStep


@register
class CaptureGridStep(StepModel):
    """Capture `repeats` pairs of each laser alone at each standoff."""

    gives: ClassVar[str | None] = "captures"
    step: Literal["capture_grid"]
    standoffs_mm: Standoffs
    repeats: Count
    order: Literal["as_listed", "shuffled"] = "as_listed"
    """`shuffled`: an order, always the same, in which a drift of the image does not follow the standoff."""
    returns: Annotated[int, Field(ge=0, le=len(RETURN_AT))] = 0
    """Number of standoffs that are visited again at the end, as another placement, to show a drift."""
    limits: CaptureLimits = CaptureLimits()

    @model_validator(mode="after")
    def _standoffs_differ(self) -> CaptureGridStep:
        require_different(self.standoffs_mm, "repeats")
        return self

    @property
    def title(self) -> str:
        """Number of standoffs and of pairs."""
        again = f" and {len(self.visits_mm) - len(self.standoffs_mm)} again" if self.returns else ""
        standoffs = counted(len(self.standoffs_mm), "standoff")
        return f"Capture at {standoffs}{again}, {counted(self.repeats, 'pair')} per laser"

    @property
    def visits_mm(self) -> tuple[float, ...]:
        """Standoffs in the order of the placements, with those that are visited again at the end."""
        order = shuffled(self.standoffs_mm) if self.order == "shuffled" else tuple(self.standoffs_mm)
        return order + returned(order, self.returns)

    def placements(self, name: str, rig: Rig) -> Sequence[Placement]:
        """One placement per standoff, then those that are visited again."""
        first = len(self.standoffs_mm)
        return [
            *(flat_placement(name, standoff_mm) for standoff_mm in self.visits_mm[:first]),
            *(flat_placement(name, standoff_mm, 2) for standoff_mm in self.visits_mm[first:]),
        ]

    def captures(self, rig: Rig) -> int:
        """Number of pairs of all lasers over all standoffs."""
        return len(self.visits_mm) * self.repeats * len(rig.lasers)

    def prompts(self, name: str, rig: Rig) -> Sequence[Prompt]:
        """Prompts of the placements, then those of limits with `on_fail: ask` and of doubtful standoffs."""
        return self._prompts(self.placements(name, rig), rig)

    def _prompts(self, placements: Sequence[Placement], rig: Rig) -> Sequence[Prompt]:
        limits = capture_limit_prompts(placements, rig, self.limits)
        return [*placement_prompts(placements), *limits, *map(standoff_prompt, placements)]

    def run(self, context: Context, name: str) -> str:
        """Capture at every placement; raises the errors of `visit_placements` and `check_captures`."""

        def work(placement: Placement) -> int:
            pairs = capture_lasers(context, placement, self.repeats)
            check_captures(context, name, placement, self.limits)
            _check_standoff(context, placement)
            _advise(context)
            return pairs

        placements = [*self.placements(name, context.rig)]
        if takes_added(context.steps, context.step_index):
            placements += self._added_placements(name, context.recorder.repairs.added_mm)
        expect = _sentences_on_lasers_outside(context.rig, placements)
        return counted(sum(visit_placements(context, placements, work, expect=expect)), "pair")

    def added_prompts(self, name: str, rig: Rig, added_mm: Sequence[float]) -> Sequence[Prompt]:
        """Prompts of the added placements; see `prompts`."""
        return self._prompts(self._added_placements(name, added_mm), rig)

    def _added_placements(self, name: str, added_mm: Sequence[float]) -> list[Placement]:
        """Placements that repairs have added after the step's own."""
        visited = list(self.visits_mm)
        added = []
        for standoff_mm in added_mm:
            number = visited.count(standoff_mm) + 1
            visited.append(standoff_mm)
            added.append(flat_placement(name, standoff_mm, number if number > 1 else None))
        return added


def _sentences_on_lasers_outside(rig: Rig, placements: Sequence[Placement]) -> dict[str, str]:
    """Sentence about the lasers whose spots are expected outside the image, by key of the placement."""
    from workbench.calibration.design.expected_spot import lasers_outside

    outside = lasers_outside(rig, sorted({placement.standoff_mm for placement in placements}))
    return {
        placement.key: f"By the rig file {', '.join(ids)} will be outside the image."
        for placement in placements
        if (ids := outside[placement.standoff_mm])
    }


def _check_standoff(context: Context, placement: Placement) -> None:
    """Compare the standoff with its prediction where a fit follows; not beside a board, as in `_advise`."""
    upcoming = _next_fit(context.steps, context.step_index)
    if upcoming is not None and not context.boards:
        check_standoff(context, placement, len(upcoming[0]))


def _advise(context: Context) -> None:
    """Journal the range uncertainty after the captures so far and the most informative next standoff.

    No advice if no fit follows, or if the board was captured, because the forecast does not use its corners.
    """
    from workbench.calibration.design.next_standoff import advise
    from workbench.procedure.engine.observed import observed_so_far

    upcoming = _next_fit(context.steps, context.step_index)
    if upcoming is None or context.boards:
        return
    planned_mm, fit = upcoming
    if (advice := advise(context.rig, observed_so_far(context), planned_mm)) is not None:
        limit = fit.limits.max_relative_range_sd
        context.emit(StandoffAdvised(limit=limit, **asdict(advice)))


def _next_fit(steps: Sequence[Step], index: int) -> tuple[tuple[float, ...], FitStep] | None:
    """Standoffs planned before the next fit step at or after `index`, and that step; None without one."""
    for number, step in enumerate(steps[index:], start=index):
        if isinstance(step, FitStep):
            grids = [one for one in steps[:number] if isinstance(one, CaptureGridStep)]
            return tuple(standoff for grid in grids for standoff in grid.visits_mm), step
    return None
