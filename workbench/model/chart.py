"""Charts as data: series, bands and limits over labelled axes, drawn by the recording and by the report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, model_validator

from workbench.model.finite import finite_or_none
from workbench.model.yamlfile import FileModel

Number = Annotated[float | None, BeforeValidator(finite_or_none)]
"""A number, or a gap: None or a number that is not finite."""
OUTLIER_SIGMA = 3.0
PALETTE = ("#56b4e9", "#e69f00", "#009e73", "#cc79a7", "#f0e442", "#d55e00", "#0072b2")
"""Colours of Okabe and Ito without black: distinguishable with every kind of colour vision."""


class Axis(FileModel):
    """One axis."""

    label: str
    """Label without the unit."""
    unit: str = ""
    scale: Literal["linear", "log"] = "linear"
    limits: tuple[float, float] | None = None
    """Ends of the axis; None: derived from the data."""

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
        """Label with the unit in brackets."""
        return f"{self.label} [{self.unit}]" if self.unit else self.label


class Series(FileModel):
    """Series of points, drawn as points or as a line."""

    name: str
    """Name in the legend. A series with the name of a laser gets the laser's colour (`series_colors`)."""
    x: tuple[float, ...]
    y: tuple[Number, ...]
    sd: tuple[Number, ...] = ()
    """Standard deviations (1 sigma) drawn as bars; empty: no bars."""
    expected_sd: tuple[Number, ...] = ()
    """Expected standard deviation of y about zero (1 sigma); points beyond 3 of these are outliers."""
    style: Literal["points", "line"] = "points"
    color: Annotated[str, Field(pattern=r"^(#[0-9a-fA-F]{6})?$")] = ""
    """`#rrggbb`; empty: chosen by `series_colors`."""
    dashed: bool = False
    """Whether a line is dashed; without effect on points."""

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
        """Lower and upper end of a point's bar; the point alone if it has no bar; empty at a gap."""
        y = self.y[index]
        if y is None:
            return ()
        sd = self.sd[index] if self.sd else None
        return (y,) if sd is None else (y - sd, y + sd)

    def runs(self) -> list[list[int]]:
        """Indices of the points between gaps, one list for each run of consecutive points."""
        runs: list[list[int]] = [[]]
        for index, y in enumerate(self.y):
            if y is not None:
                runs[-1].append(index)
            elif runs[-1]:
                runs.append([])
        return [run for run in runs if run]

    def sigmas(self, index: int) -> float | None:
        """Distance of a point from zero in expected standard deviations; None if either is unknown."""
        y = self.y[index]
        expected = self.expected_sd[index] if self.expected_sd else None
        return abs(y) / expected if y is not None and expected else None

    def is_outlier(self, index: int) -> bool:
        """Whether a point lies more than `OUTLIER_SIGMA` expected standard deviations from zero."""
        sigmas = self.sigmas(index)
        return sigmas is not None and sigmas > OUTLIER_SIGMA


class Band(FileModel):
    """Area between two curves: an interval or a tolerance."""

    name: str
    x: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]

    @model_validator(mode="after")
    def _lengths_agree(self) -> Band:
        if not len(self.x) == len(self.low) == len(self.high):
            lengths = len(self.x), len(self.low), len(self.high)
            raise ValueError(f"band {self.name}: expected x, low and high of equal length, got {lengths}")
        return self


class LimitLine(FileModel):
    """Horizontal line at a limit on y."""

    name: str
    y: float


class Chart(FileModel):
    """Chart of series, bands and limits over two axes."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-][A-Za-z0-9_.-]*$")]
    """Name of the chart's file and of its entity in the recording."""
    title: str
    x: Axis
    y: Axis
    series: tuple[Series, ...]
    bands: tuple[Band, ...] = ()
    limits: tuple[LimitLine, ...] = ()
    flagged_x: tuple[float, ...] = ()
    """Values of x whose points contradict the others; shaded."""
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
        """Whether the series contain no point."""
        return all(y is None for series in self.series for y in series.y)

    def x_values(self) -> list[float]:
        """Distinct values of x at which series have points, ascending."""
        return sorted({x for s in self.series for x, y in zip(s.x, s.y, strict=True) if y is not None})

    def y_values(self) -> list[float]:
        """Distinct values of y of points, ends of bars, bands and limits, ascending."""
        values = {limit.y for limit in self.limits}
        for band in self.bands:
            values.update(band.low, band.high)
        for series in self.series:
            values.update(end for i in range(len(series.x)) for end in series.bar(i))
        return sorted(values)


def laser_colors(laser_ids: Sequence[str]) -> dict[str, str]:
    """Colour (`#rrggbb`) of each laser, in the order of the rig file; colours repeat after seven lasers."""
    return dict(zip(laser_ids, cycle(PALETTE), strict=False))


def series_colors(series: Sequence[Series], named: Mapping[str, str]) -> list[str]:
    """Colour (`#rrggbb`) of each series: its own, else that of its name, else the next unused of the palette.

    Args:
        series: all series of one chart.
        named: colours by series name, for example of lasers.
    """
    known = [one.color or named.get(one.name, "") for one in series]
    used = {color.lower() for color in known}
    free = cycle([color for color in PALETTE if color not in used] or PALETTE)
    return [color or next(free) for color in known]
