"""Charts as data: series, bands and limits over labelled axes, drawn by the recording and by the report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, model_validator

from workbench.model.finite import finite_or_none
from workbench.model.yamlfile import FileModel

Number = Annotated[float | None, BeforeValidator(finite_or_none)]
"""None makes a gap, as does a number that is not finite."""
OUTLIER_SIGMA = 3.0
PALETTE = ("#56b4e9", "#e69f00", "#009e73", "#cc79a7", "#f0e442", "#d55e00", "#0072b2")
"""Okabe and Ito's colours, which people with any colour vision can tell apart, without their black."""


class Axis(FileModel):
    """One axis."""

    label: str
    """Without the unit."""
    unit: str = ""
    scale: Literal["linear", "log"] = "linear"
    limits: tuple[float, float] | None = None
    """None: from the data."""

    @model_validator(mode="after")
    def _limits_make_an_axis(self) -> Axis:
        low, high = self.limits or (1.0, 2.0)
        if low >= high or (self.scale == "log" and low <= 0):
            raise ValueError(
                f"axis {self.label}: expected ascending limits, above 0 if log, got {self.limits}"
            )
        return self

    @property
    def text(self) -> str:
        """Label and unit."""
        return f"{self.label} [{self.unit}]" if self.unit else self.label


class Series(FileModel):
    """Points of one kind, joined by a line or not."""

    name: str
    """In the legend. A series named as a laser has the laser's colour, see `series_colors`."""
    x: tuple[float, ...]
    y: tuple[Number, ...]
    sd: tuple[Number, ...] = ()
    """1 sigma, drawn as a bar; none at all where it is empty."""
    expected_sd: tuple[Number, ...] = ()
    """1 sigma of everything that moves y from zero. Beyond 3 of these a point is marked as an outlier."""
    style: Literal["points", "line"] = "points"
    color: Annotated[str, Field(pattern=r"^(#[0-9a-fA-F]{6})?$")] = ""
    """`#rrggbb`; empty: as `series_colors` chooses."""
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

    def bar(self, index: int) -> tuple[float, ...]:
        """Lower and upper end of a point's bar; the point itself without a bar, nothing at a gap."""
        y = self.y[index]
        if y is None:
            return ()
        sd = self.sd[index] if self.sd else None
        return (y,) if sd is None else (y - sd, y + sd)

    def sigmas(self, index: int) -> float | None:
        """Distance of a point from zero in its expected standard deviations; None where it is not known."""
        y = self.y[index]
        expected = self.expected_sd[index] if self.expected_sd else None
        return abs(y) / expected if y is not None and expected else None

    def is_outlier(self, index: int) -> bool:
        """Whether a point lies farther from zero than its expected standard deviation explains."""
        sigmas = self.sigmas(index)
        return sigmas is not None and sigmas > OUTLIER_SIGMA


class Band(FileModel):
    """An area between two curves: an interval, or what is tolerated."""

    name: str
    x: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]

    @model_validator(mode="after")
    def _lengths_agree(self) -> Band:
        if not len(self.x) == len(self.low) == len(self.high):
            lengths = len(self.x), len(self.low), len(self.high)
            raise ValueError(f"band {self.name}: expected as many x, low and high, got {lengths}")
        return self


class LimitLine(FileModel):
    """A horizontal line that y is held against."""

    name: str
    y: float


class Chart(FileModel):
    """What is drawn over two axes."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-][A-Za-z0-9_.-]*$")]
    """Names the chart's file and its place in the recording."""
    title: str
    x: Axis
    y: Axis
    series: tuple[Series, ...]
    bands: tuple[Band, ...] = ()
    limits: tuple[LimitLine, ...] = ()
    caption: str = ""

    @model_validator(mode="after")
    def _log_axes_have_positive_data(self) -> Chart:
        xs = [x for series in self.series for x in series.x] + [x for band in self.bands for x in band.x]
        ys = [y for series in self.series for y in series.y if y is not None]
        ys += [y for band in self.bands for y in (*band.low, *band.high)] + [one.y for one in self.limits]
        for axis, values in ((self.x, xs), (self.y, ys)):
            if axis.scale == "log" and min(values, default=1.0) <= 0:
                where = f"chart {self.name}, log axis {axis.label}"
                raise ValueError(f"{where}: expected values above 0, got {min(values)}")
        return self

    @property
    def is_empty(self) -> bool:
        """Whether no series has a point."""
        return all(y is None for series in self.series for y in series.y)

    def x_values(self) -> list[float]:
        """Where series have points; ascending, each once."""
        return sorted({x for s in self.series for x, y in zip(s.x, s.y, strict=True) if y is not None})

    def y_values(self) -> list[float]:
        """Everything that is drawn: points, ends of their bars, bands, limits; ascending, each once."""
        values = {limit.y for limit in self.limits}
        for band in self.bands:
            values.update(band.low, band.high)
        for series in self.series:
            values.update(end for i in range(len(series.x)) for end in series.bar(i))
        return sorted(values)


def laser_colors(laser_ids: Sequence[str]) -> dict[str, str]:
    """One colour (`#rrggbb`) a laser, in the order of the rig file; they repeat after seven."""
    return dict(zip(laser_ids, cycle(PALETTE), strict=False))


def series_colors(series: Sequence[Series], named: Mapping[str, str]) -> list[str]:
    """Colour (`#rrggbb`) of each series: its own, else that of its name, else the next unused of the palette.

    Args:
        series: of one chart.
        named: colours by name, such as those of lasers.
    """
    known = [one.color or named.get(one.name, "") for one in series]
    used = {color.lower() for color in known}
    free = cycle([color for color in PALETTE if color not in used] or PALETTE)
    return [color or next(free) for color in known]
