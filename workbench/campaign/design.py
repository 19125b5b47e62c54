"""Campaign `design`: cost against accuracy of calibrations, forecast over a grid of procedures."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Annotated, Literal

import pandas as pd
from pydantic import Field, model_validator

from workbench.calibration.design.forecast import forecast
from workbench.campaign.kind import Chunk, ChunkSize, Inputs, Summary, Work
from workbench.campaign.rig_input import read_rig, rig_of
from workbench.model.chart import Axis, Chart, Series
from workbench.model.errors import BadInputError
from workbench.model.fields import Count, Standoffs, require_different
from workbench.model.rig import NonNegativeFloat
from workbench.model.table import PERCENT, Column, Table

RIGS = "rigs"
MOST_POINTS = 10_000
"""Largest number of points of a grid."""
MINUTE_S = 60.0


@dataclass(frozen=True)
class _Point:
    """One point of the grid."""

    rig: str
    """Text of the rig file."""
    standoffs_mm: Sequence[float]
    repeats: int


class Design(Work):
    """A grid of calibrations, each forecast without data."""

    thing = "design"

    kind: Literal["design"]
    rigs: Annotated[tuple[Path, ...], Field(min_length=1)]
    """Rig files, relative to the campaign file."""
    standoffs_mm: Annotated[tuple[Standoffs, ...], Field(min_length=1)]
    """Sets of standoffs."""
    repeats: Annotated[tuple[Count, ...], Field(min_length=1)]
    """Numbers of captures of each laser at each standoff."""
    placement_s: NonNegativeFloat = 60.0
    """Time to place the target at a standoff."""
    capture_s: NonNegativeFloat = 0.5
    """Time of one capture."""
    chunk: ChunkSize = 4

    @model_validator(mode="after")
    def _grid_is_bounded(self) -> Design:
        for standoffs in self.standoffs_mm:
            require_different(standoffs, "repeats")
        if (points := len(self.rigs) * len(self.standoffs_mm) * len(self.repeats)) > MOST_POINTS:
            raise ValueError(f"expected a grid of at most {MOST_POINTS} designs, got {points}")
        return self

    @property
    def input_keys(self) -> tuple[str, ...]:
        """The rig files."""
        return (RIGS,)

    def read_input(self, key: str, base: Path) -> str:
        """Texts of the rig files."""
        return json.dumps([read_rig(base / path) for path in self.rigs])

    def count(self, inputs: Inputs) -> int:
        """Number of points."""
        return len(self._points(inputs))

    def run(self, inputs: Inputs, chunk: Chunk, folder: Path) -> pd.DataFrame:
        """One row per point: captures, time, and the largest relative uncertainty of a range."""
        points = self._points(inputs)
        return pd.DataFrame([self._row(points[item]) for item in chunk.items]).astype(TYPES)

    def _points(self, inputs: Inputs) -> list[_Point]:
        grid = product(json.loads(inputs[RIGS]), self.standoffs_mm, self.repeats)
        return [_Point(*one) for one in grid]

    def _row(self, point: _Point) -> dict[str, object]:
        rig = rig_of(point.rig)
        captures = len(point.standoffs_mm) * point.repeats * len(rig.lasers)
        total_s = len(point.standoffs_mm) * self.placement_s + captures * self.capture_s
        row: dict[str, object] = {
            "rig": rig.rig,
            "standoffs_mm": " ".join(f"{one:.12g}" for one in point.standoffs_mm),
            "standoffs": len(point.standoffs_mm),
            "repeats": point.repeats,
            "captures": captures,
            "minutes": total_s / MINUTE_S,
            "reason": "",
        }
        try:
            found = forecast(rig, point.standoffs_mm, point.repeats)
        except BadInputError as error:
            return row | {"relative_sd": None, "relative_sd_of_calibration": None, "reason": str(error)}
        return row | {
            "relative_sd": found.worst_relative_sd,
            "relative_sd_of_calibration": found.worst_relative_sd_of_calibration,
        }

    def summarise(self, inputs: Inputs, frames: Iterable[pd.DataFrame]) -> Summary:
        """The Pareto front: designs that no other one surpasses in both time and accuracy."""
        every = pd.concat(list(frames), ignore_index=True)
        front = pareto_front(every)
        best = front.iloc[-1] if len(front) else None
        most_accurate = (
            ""
            if best is None
            else f"; the most accurate takes {best['minutes']:.0f} min and states"
            f" {PERCENT * best['relative_sd_of_calibration']:.2g} %"
        )
        impossible = int(every["relative_sd"].isna().sum())
        return Summary(
            headline=f"{len(front)} of {len(every)} designs are on the Pareto front{most_accurate}",
            tables=(_front_table(front), _grid_table(every)),
            charts=(_chart(every, front),),
            notes=(f"{impossible} designs have a standoff without a spot",) if impossible else (),
        )


TYPES = {
    "rig": "string",
    "standoffs_mm": "string",
    "standoffs": "int64",
    "repeats": "int64",
    "captures": "int64",
    "minutes": "float64",
    "relative_sd": "float64",
    "relative_sd_of_calibration": "float64",
    "reason": "string",
}
"""Columns of the results, with their types."""
COLUMNS = (
    Column(key="rig", name="rig"),
    Column(key="standoffs", name="standoffs"),
    Column(key="repeats", name="repeats"),
    Column(key="captures", name="captures"),
    Column(key="minutes", name="time", unit="min", format=".1f"),
    Column(key="relative_sd_of_calibration", name="calibration", unit="%", format=".3f", scale=PERCENT),
    Column(key="relative_sd", name="one range", unit="%", format=".3f", scale=PERCENT),
    Column(key="standoffs_mm", name="at", unit="mm"),
)


def pareto_front(designs: pd.DataFrame) -> pd.DataFrame:
    """Designs in order of time, each more accurate than all that take no longer."""
    known = designs.dropna(subset=["relative_sd_of_calibration"])
    ordered = known.sort_values(["minutes", "relative_sd_of_calibration"], kind="stable")
    best = ordered["relative_sd_of_calibration"].cummin().shift(fill_value=float("inf"))
    return ordered[ordered["relative_sd_of_calibration"] < best].reset_index(drop=True)


def _front_table(front: pd.DataFrame) -> Table:
    return _table("front", "Pareto front", front, is_detail=False)


def _grid_table(every: pd.DataFrame) -> Table:
    return _table("designs", "All designs", every, is_detail=True)


def _table(name: str, title: str, designs: pd.DataFrame, is_detail: bool) -> Table:
    rows = designs[[column.key for column in COLUMNS]].itertuples(index=False)
    return Table(
        name=name,
        title=title,
        columns=COLUMNS,
        rows=tuple(map(tuple, rows)),
        caption="largest relative sd from 0.1 to 5 m, 1 sigma: of the calibration alone, and of one range",
        is_detail=is_detail,
    )


def _chart(every: pd.DataFrame, front: pd.DataFrame) -> Chart:
    series = [
        Series(
            name=name,
            x=tuple(part["minutes"].tolist()),
            y=tuple((PERCENT * part["relative_sd_of_calibration"]).tolist()),
            style="line" if part is front else "points",
        )
        for name, part in (*every.groupby("rig", sort=False), ("Pareto front", front))
    ]
    return Chart(
        name="front",
        title="Cost against accuracy: time of a calibration, and its largest relative sd of a range",
        x=Axis(label="time", unit="min"),
        y=Axis(label="sd / range", unit="%", scale="log"),
        series=tuple(series),
    )
