"""Activity of the session: text log, and lanes of states over time."""

from __future__ import annotations

import rerun as rr

from workbench.viewer import entities as at
from workbench.viewer.stream import Stream

INFO = rr.TextLogLevel.INFO
WARN = rr.TextLogLevel.WARN
LASERS_OFF = "off"
ENDED = "ended"
ERROR = rr.TextLogLevel.ERROR
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


def end_all(stream: Stream) -> None:
    """Log the end in every lane."""
    for entity in LANES:
        lane(stream, entity, ENDED)
