"""Log lines and lanes."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.viewer_stream import HERE, logged
from workbench.model.event import StandoffAdvised
from workbench.viewer.steps import (
    ENDED,
    ERROR,
    INFO,
    WARN,
    end_all,
    lane,
    log_advice,
    log_styles,
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


def test_the_range_uncertainty_so_far_and_its_limit_are_per_cents(tmp_path: Path) -> None:
    advice = StandoffAdvised(
        placements=4,
        relative_range_sd=0.021,
        limit=0.03,
        next_standoff_mm=4500.0,
        then_relative_range_sd=0.018,
    )

    def log(stream: Stream) -> None:
        log_styles(stream)
        log_advice(stream, advice)

    contents = logged(tmp_path, log)
    for name, value in (("largest_range_sd", 2.1), ("limit", 3.0)):
        ((_, (logged_value,)),) = contents.values(f"/advice/{name}", "Scalars:scalars")
        assert logged_value == pytest.approx(value)
    assert contents.static("/advice/limit", "SeriesLines:names") == [["limit"]]
    assert contents.static("/advice/largest_range_sd", "SeriesPoints:names") == [["so far"]]
