"""Activity of the session: text log, and lanes of states over time."""

from __future__ import annotations

import rerun as rr

from workbench.model.event import StandoffAdvised
from workbench.viewer import entities as at
from workbench.viewer.stream import Stream

INFO = rr.TextLogLevel.INFO
WARN = rr.TextLogLevel.WARN
LASERS_OFF = "off"
ENDED = "ended"
ERROR = rr.TextLogLevel.ERROR
PERCENT = 100.0
LANES = (
    at.LANE_PROCEDURE,
    at.LANE_STEP,
    at.LANE_LASER,
    at.LANE_EXPOSURE,
    at.LANE_SATURATION,
    at.LANE_DARK,
)


def log_text(stream: Stream, text: str, level: rr.TextLogLevel = INFO) -> None:
    """Log one line of text."""
    stream.log(at.STEP_LOG, rr.TextLog(text, level=level))


def lane(stream: Stream, entity: str, state: str) -> None:
    """Log a new state of one lane."""
    stream.log(entity, rr.StateChange(state=state))


def log_styles(stream: Stream) -> None:
    """Log names and colours of the curves of the range uncertainty."""
    markers = rr.SeriesPoints(colors=at.WHITE, names="so far", markers="circle", marker_sizes=5.0)
    stream.log(at.RANGE_SD, markers, static=True)
    limit = rr.SeriesLines(colors=at.RED, names="limit", interpolation_mode="StepAfter")
    stream.log(at.RANGE_SD_LIMIT, limit, static=True)


def log_advice(stream: Stream, advice: StandoffAdvised) -> None:
    """Log the largest range uncertainty so far and its limit, in per cent."""
    stream.log(at.RANGE_SD, rr.Scalars(PERCENT * advice.relative_range_sd))
    stream.log(at.RANGE_SD_LIMIT, rr.Scalars(PERCENT * advice.limit))


def end_all(stream: Stream) -> None:
    """Log the end in every lane."""
    for entity in LANES:
        lane(stream, entity, ENDED)
