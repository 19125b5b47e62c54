"""Step `spread_trial`: the spread of readings at each placement, as a table and a chart.

Everything about this trial is in this module. The entry point in `pyproject.toml` is all that makes the
workbench find it: `check`, `plan`, `run`, `resume`, the terminal, the recording and the CSV files follow.
"""

from __future__ import annotations

from collections.abc import Sequence
from statistics import stdev
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from workbench.model.chart import Axis, Chart, Series
from workbench.model.fields import Count, Standoffs, require_different
from workbench.model.rig import Rig
from workbench.model.table import Column, Table
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.placements import visit_placements
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel, flat_placement
from workbench.trials.readings import session_ranger, take_readings
from workbench.trials.results import finish_trial

Row = tuple[float, int, float | None]


@register
class SpreadTrialStep(StepModel):
    """Repeated readings of a flat, and their standard deviation at each standoff."""

    needs: ClassVar[str | None] = "calibration"
    step: Literal["spread_trial"]
    standoffs_mm: Standoffs
    readings: Annotated[Count, Field(ge=2)] = 5

    @model_validator(mode="after")
    def _standoffs_differ(self) -> SpreadTrialStep:
        require_different(self.standoffs_mm, "readings")
        return self

    @property
    def title(self) -> str:
        """For the progress line."""
        return f"Spread at {len(self.standoffs_mm)} standoffs"

    def placements(self, name: str, rig: Rig) -> Sequence[Placement]:
        """One a standoff."""
        return [flat_placement(name, standoff_mm) for standoff_mm in self.standoffs_mm]

    def captures(self, rig: Rig) -> int:
        """One a reading."""
        return len(self.standoffs_mm) * self.readings

    def run(self, context: Context, name: str) -> str:
        """Take the readings, and return their spread."""
        ranger = session_ranger(context, name)

        def work(placement: Placement) -> Row:
            readings = take_readings(context, ranger, name, placement, self.readings)
            ranges = [reading.range_mm for reading in readings if reading.range_mm is not None]
            return placement.standoff_mm, len(ranges), stdev(ranges) if len(ranges) > 1 else None

        rows = visit_placements(context, self.placements(name, context.rig), work)
        finish_trial(context, name, [spread_table(name, rows)], [spread_chart(name, rows)])
        return f"{len(rows)} standoffs, table in {name}.csv"


def spread_table(name: str, rows: Sequence[Row]) -> Table:
    """One row a standoff."""
    return Table(
        name=name,
        title="Spread of readings",
        columns=(
            Column(key="standoff_mm", name="standoff", unit="mm"),
            Column(key="readings", name="n"),
            Column(key="sd_mm", name="sd", unit="mm", format=".3f"),
        ),
        rows=tuple(rows),
        caption="sd: of the readings at one placement",
    )


def spread_chart(name: str, rows: Sequence[Row]) -> Chart:
    """Standard deviation over standoff."""
    return Chart(
        name=f"{name}-spread",
        title="Spread of readings",
        x=Axis(label="standoff", unit="mm", scale="log"),
        y=Axis(label="sd", unit="mm"),
        series=(
            Series(name="readings", x=tuple(r[0] for r in rows), y=tuple(r[2] for r in rows), style="line"),
        ),
    )
