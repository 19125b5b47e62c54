"""Captures of a recording and the moments of their placements."""

from __future__ import annotations

import pytest

from tests.support.viewer_stream import START_NS
from workbench.model.event import CaptureTaken, FrameRef
from workbench.model.target import Placement
from workbench.viewer.captures import CaptureLog
from workbench.viewer.stream import Moment


def log_of(*captures: tuple[str, float, str]) -> CaptureLog:
    """Log of captures of (placement, standoff, laser)."""
    log = CaptureLog()
    for n, (placement, standoff_mm, laser) in enumerate(captures, start=1):
        capture = CaptureTaken(
            key=f"c{n}",
            purpose="calibration",
            laser_id=laser,
            placement_key=placement,
            standoff_mm=standoff_mm,
            repeat=0,
            on=FrameRef(path="x.png", sha256="0" * 64, time_ns=START_NS + n),
        )
        where = Placement(key=placement, standoff_mm=standoff_mm)
        log.add(capture, where, Moment(n, 1, START_NS + n, standoff_mm))
    return log


TWICE = log_of(
    ("a", 500.0, "L1"),
    ("a", 500.0, "L1"),
    ("a", 500.0, "L2"),
    ("b", 900.0, "L1"),
    ("c", 500.0, "L1"),
    ("c", 500.0, "L2"),
)
"""Two placements at 500 mm."""


@pytest.mark.parametrize(
    ("placement", "standoff_mm", "laser", "capture"),
    [
        ("a", 500.0, None, 1),
        ("a", 500.0, "L2", 3),
        ("b", 900.0, "L1", 4),
        ("c", 500.0, None, 5),
        ("c", 500.0, "L2", 6),
        (None, 500.0, None, 1),
        (None, 500.0, "L2", 3),
        (None, 900.0, None, 4),
    ],
)
def test_the_first_capture_at_a_placement_is_found(
    placement: str | None, standoff_mm: float, laser: str | None, capture: int
) -> None:
    found = TWICE.first_of(placement, standoff_mm, laser)
    assert found is not None
    assert found.capture == capture


@pytest.mark.parametrize(
    ("placement", "standoff_mm", "laser"), [("b", 900.0, "L2"), ("d", 500.0, None), (None, 501.0, None)]
)
def test_where_nothing_was_captured_there_is_no_moment(
    placement: str | None, standoff_mm: float, laser: str | None
) -> None:
    assert TWICE.first_of(placement, standoff_mm, laser) is None


def test_captures_have_numbers_placements_and_ranges_by_placement() -> None:
    assert TWICE.numbers == {f"c{n}": n for n in range(1, 7)}
    assert TWICE.ranges() == {"a": "1-3", "b": "4-4", "c": "5-6"}
    placement = TWICE.placements["c4"]
    assert placement is not None
    assert placement.key == "b"
    assert CaptureLog().ranges() == {}
