"""View of a running calibration: how the uncertainty of ranges and parameters decreases."""

from __future__ import annotations

from dataclasses import dataclass, field

import rerun as rr

from workbench.figures.picture import SMALL_PX
from workbench.model.chart import Axis, Chart, LimitLine, Series
from workbench.model.event import StandoffAdvised
from workbench.viewer import entities as at
from workbench.viewer.chart import log_chart
from workbench.viewer.stream import Stream

PERCENT = 100.0
NOTHING_YET = "from the second placement on"
EARLIER, LATEST = "#5a6068", "#e6e6e6"
SHOWN_PARAMETERS = 7
"""Number of parameters in the chart: those of lens and reference come first."""


@dataclass
class AdviceView:
    """Pictures of the range uncertainty and of the parameters after each placement."""

    stream: Stream
    advice: list[StandoffAdvised] = field(default_factory=list)

    def start(self) -> None:
        """Log styles, and notes in place of the pictures."""
        points = rr.SeriesPoints(colors=at.WHITE, names="so far", markers="circle", marker_sizes=5.0)
        self.stream.log(at.RANGE_SD, points, static=True)
        limit = rr.SeriesLines(colors=at.RED, names="limit", interpolation_mode="StepAfter")
        self.stream.log(at.RANGE_SD_LIMIT, limit, static=True)
        self._draw()

    def take(self, advice: StandoffAdvised) -> None:
        """Log the largest range uncertainty and its limit, in per cent, and draw the pictures again."""
        self.stream.log(at.RANGE_SD, rr.Scalars(PERCENT * advice.relative_range_sd))
        self.stream.log(at.RANGE_SD_LIMIT, rr.Scalars(PERCENT * advice.limit))
        self.advice.append(advice)
        self._draw()

    def _draw(self) -> None:
        known = [one for one in self.advice if one.ranges_mm]
        for entity, chart in (
            (at.UNCERTAINTY, uncertainty_chart(known)),
            (at.NARROWING, narrowing_chart(known)),
        ):
            log_chart(self.stream, entity, chart, {}, NOTHING_YET, SMALL_PX)


def uncertainty_chart(advice: list[StandoffAdvised]) -> Chart:
    """Standard uncertainty of a single range over the range, in per cent, after each placement."""
    series = tuple(
        Series(
            name=f"{one.placements}",
            x=one.ranges_mm,
            y=tuple(PERCENT * sd for sd in one.range_sd),
            style="line",
            color=LATEST if one is advice[-1] else EARLIER,
        )
        for one in advice
    )
    limits = (LimitLine(name="limit", y=PERCENT * advice[-1].limit),) if advice else ()
    return Chart(
        name="uncertainty",
        title="Standard uncertainty of a range after each placement",
        x=Axis(label="range", unit="mm", scale="log"),
        y=Axis(label="u", unit="%", scale="log"),
        series=series,
        limits=limits,
    )


def narrowing_chart(advice: list[StandoffAdvised]) -> Chart:
    """Standard deviation of the first parameters, relative to their priors, over the placements."""
    names = list(advice[-1].parameter_sd)[:SHOWN_PARAMETERS] if advice else []
    return Chart(
        name="narrowing",
        title="Standard deviation of parameters, relative to the rig file's",
        x=Axis(label="placements"),
        y=Axis(label="sd / prior sd", scale="log"),
        series=tuple(
            Series(
                name=name,
                x=tuple(float(one.placements) for one in advice),
                y=tuple(one.parameter_sd.get(name) for one in advice),
                style="line",
            )
            for name in names
        ),
    )
