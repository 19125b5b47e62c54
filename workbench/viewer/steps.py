"""What the session is doing: a text log, and lanes of states over time."""

from __future__ import annotations

import rerun as rr

from workbench.viewer import entities as at
from workbench.viewer.stream import Stream

INFO = rr.TextLogLevel.INFO
WARN = rr.TextLogLevel.WARN
LASERS_OFF = "off"
ENDED = "ended"
ERROR = rr.TextLogLevel.ERROR


def say(stream: Stream, text: str, level: rr.TextLogLevel = INFO) -> None:
    """One line of the log."""
    stream.log(at.STEP_LOG, rr.TextLog(text, level=level))


def lane(stream: Stream, entity: str, state: str) -> None:
    """The state of one lane from now on."""
    stream.log(entity, rr.StateChange(state=state))


def end_all(stream: Stream) -> None:
    """Nothing is going on any more."""
    for entity in (at.LANE_PROCEDURE, at.LANE_STEP, at.LANE_LASER):
        lane(stream, entity, ENDED)
