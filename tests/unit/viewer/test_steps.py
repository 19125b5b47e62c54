"""Log lines and lanes."""

from __future__ import annotations

from pathlib import Path

from tests.support.viewer_stream import HERE, logged
from workbench.viewer.steps import (
    ENDED,
    ERROR,
    INFO,
    WARN,
    end_all,
    lane,
    log_text,
)
from workbench.viewer.stream import Moment, Stream


def test_a_line_has_its_level(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        for level in (INFO, WARN, ERROR):
            log_text(stream, f"a line of {level}", level)
        log_text(stream, "plain")

    contents = logged(tmp_path, log)
    levels = [level for _, (level,) in contents.values("/steps/log", "TextLog:level")]
    assert levels == ["INFO", "WARN", "ERROR", "INFO"]
    assert contents.values("/steps/log", "TextLog:text")[-1] == (1, ["plain"])


def test_a_lane_changes_its_state_from_its_moment_on(tmp_path: Path) -> None:
    def log(stream: Stream) -> None:
        lane(stream, "steps/lanes/laser", "L1")
        stream.at(Moment(4, 1, HERE.time_ns + 1))
        lane(stream, "steps/lanes/laser", "L2")

    found = logged(tmp_path, log).values("/steps/lanes/laser", "StateChange:state")
    assert found == [(1, ["L1"]), (4, ["L2"])]


def test_the_end_ends_every_lane(tmp_path: Path) -> None:
    contents = logged(tmp_path, end_all)
    lanes = {entity for entity in contents.entities if entity.startswith("/steps/lanes/")}
    names = ("procedure", "step", "laser", "exposure", "saturation", "dark_frame")
    assert lanes == {f"/steps/lanes/{name}" for name in names}
    for entity in lanes:
        assert contents.values(entity, "StateChange:state") == [(1, [ENDED])]
