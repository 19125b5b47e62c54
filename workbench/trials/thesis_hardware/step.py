"""Step `thesis_comparison`: compare the session's readings with the thesis's hardware tests."""

from __future__ import annotations

from typing import ClassVar, Literal

from workbench.procedure.engine.context import Context
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel


@register
class ThesisComparisonStep(StepModel):
    """Compare the readings of the session's trials with figures 33 to 42 of the thesis."""

    needs: ClassVar[str | None] = "readings"
    step: Literal["thesis_comparison"]

    @property
    def title(self) -> str:
        """Subject of the comparison."""
        return "Compare with the thesis's hardware tests"

    def run(self, context: Context, name: str) -> str:
        """Write the table and the figures.

        Raises:
            StoppedError: the disk is full or cannot be written.
        """
        from workbench.trials.results import finish_trial
        from workbench.trials.thesis_hardware.comparison import compare
        from workbench.trials.thesis_hardware.report import figures, goal_table, side_by_side

        rows = compare(context.readings)
        tables = [side_by_side(name, rows), *goal_table(name, rows)]
        finish_trial(context, name, tables, figures(name, context.readings))
        goals = [row.is_reached for row in rows if row.is_reached is not None]
        return f"{len(rows)} rows, {sum(goals)} of {len(goals)} goals reached, table in {name}.csv"
