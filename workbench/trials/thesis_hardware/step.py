"""Step `thesis_comparison`: compare the session's readings with the thesis's hardware tests."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Literal

from workbench.model.limit import Limit
from workbench.model.prompt import Prompt
from workbench.model.rig import Rig
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.limits import result_limit_prompts
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel
from workbench.trials.trial_step import ResultLimits


class ComparisonLimits(ResultLimits):
    """Limits on the rows with readings; the table's values have no uncertainty."""

    goal_ratio: Limit | None = None
    """Ours / goal of every row with a goal; 1 reaches it."""
    thesis_ratio: Limit | None = None
    """Ours / thesis of every row with a value of the thesis."""
    goals_missed: Limit | None = None
    """Number of goals that are not reached."""


@register
class ThesisComparisonStep(StepModel):
    """Compare the readings of the session's trials with figures 33 to 42 of the thesis."""

    needs: ClassVar[str | None] = "readings"
    step: Literal["thesis_comparison"]
    limits: ComparisonLimits = ComparisonLimits()

    @property
    def title(self) -> str:
        """Subject of the comparison."""
        return "Compare with the thesis's hardware tests"

    def prompts(self, name: str, rig: Rig) -> Sequence[Prompt]:
        """Prompts of the limits."""
        return [*super().prompts(name, rig), *result_limit_prompts(name, self.limits)]

    def run(self, context: Context, name: str) -> str:
        """Write the table and the figures, then compare with the limits.

        Raises:
            LimitFailedError: a limit failed.
            StoppedError: the disk is full or cannot be written.
            WorkbenchError: see `check_results`.
        """
        from workbench.trials.limits import check_results
        from workbench.trials.results import finish_trial
        from workbench.trials.thesis_hardware.comparison import compare, comparison_results
        from workbench.trials.thesis_hardware.report import figures, goal_table, readings_table, side_by_side

        rows = compare(context.readings, context.rig)
        tables = [side_by_side(name, rows), readings_table(name, rows), *goal_table(name, rows)]
        finish_trial(context, name, tables, figures(name, context.readings))
        check_results(context, name, comparison_results(rows), self.limits)
        goals = [row.is_reached for row in rows if row.is_reached is not None]
        return f"{len(rows)} rows, {sum(goals)} of {len(goals)} goals reached, table in {name}.csv"
