"""Charts as data: series, bands and limits over labelled axes, drawn by the recording and by the report."""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from workbench.model.yamlfile import FileModel

Number = float | None
"""None makes a gap."""


class Axis(FileModel):
    """One axis."""

    label: str
    """Without the unit."""
    unit: str = ""
    scale: Literal["linear", "log"] = "linear"
    limits: tuple[float, float] | None = None
    """None: from the data."""

    @property
    def text(self) -> str:
        """Label and unit."""
        return f"{self.label} [{self.unit}]" if self.unit else self.label


class Series(FileModel):
    """Points of one kind, joined by a line or not."""

    name: str
    """In the legend. A series named as a laser has the laser's colour."""
    x: tuple[float, ...]
    y: tuple[Number, ...]
    sd: tuple[Number, ...] = ()
    """1 sigma, drawn as a bar; none at all where it is empty."""
    expected_sd: tuple[Number, ...] = ()
    """1 sigma of everything that moves y from zero. Beyond 3 of these a point is marked as an outlier."""
    style: Literal["points", "line"] = "points"
    color: str = ""
    """`#rrggbb`; empty: by its name, or the next of the palette."""
    dashed: bool = False

    @model_validator(mode="after")
    def _lengths_agree(self) -> Series:
        for name in ("y", "sd", "expected_sd"):
            values = getattr(self, name)
            if len(values) != len(self.x) and (values or name == "y"):
                raise ValueError(
                    f"series {self.name}: expected {len(self.x)} values of {name}, got {len(values)}"
                )
        return self


class Band(FileModel):
    """An area between two curves: an interval, or what is tolerated."""

    name: str
    x: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]


class Limit(FileModel):
    """A horizontal line that y is held against."""

    name: str
    y: float


class Chart(FileModel):
    """What is drawn over two axes."""

    name: str
    """Names the chart's file and its place in the recording."""
    title: str
    x: Axis
    y: Axis
    series: tuple[Series, ...]
    bands: tuple[Band, ...] = ()
    limits: tuple[Limit, ...] = ()
    caption: str = ""
