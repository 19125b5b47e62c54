"""Live readings in the viewer: the answer, the plan view, frames and spots."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import rerun.blueprint as rrb

from tests.support.rangers import spots, thesis_ranger
from tests.support.viewer_stream import logged
from tests.viewer.session import a_rig
from workbench.ranging.acquire import acquire
from workbench.ranging.ranger import Ranger, Reading
from workbench.spots import Finding
from workbench.viewer.ranger_view import (
    PLAN_HEIGHT,
    Depths,
    RangerView,
    Shown,
    answer_text,
    closest_bar,
    contour,
    interval_of,
    ranger_layout,
)
from workbench.viewer.stream import Stream

INCLINE_MM = {"L1": 812.0, "L2": 806.0, "L3": 794.0, "L4": 788.0}


@pytest.fixture(scope="module")
def ranger() -> Ranger:
    return thesis_ranger()


def origins(part: object) -> list[str]:
    """Origins of all views of a layout."""
    if isinstance(part, rrb.Container):
        return [origin for below in part.contents for origin in origins(below)]
    return [str(part.origin)] if isinstance(part, rrb.View) else []


def reading_at(ranger: Ranger, **ranges_mm: float) -> Reading:
    found = Finding(tuple(spots(ranger, ranges_mm)))
    return acquire(ranger, "s", lambda _: found)


def test_the_answer_has_range_interval_and_shape(ranger: Ranger) -> None:
    reading = reading_at(ranger, L1=800.0, L2=800.0, L3=800.0, L4=800.0)
    text = answer_text(reading)
    first, second, *_ = text.split("\n\n")
    assert float(first.split()[1]) == pytest.approx(800.0, abs=1.0)
    assert reading.interval_mm is not None
    low, high = reading.interval_mm
    assert f"{low:.1f} to {high:.1f} mm" in second
    shape = reading.lines[0].shape
    assert shape.kind in text
    most, probability = max(shape.probabilities.items(), key=lambda one: one[1])
    assert f"{most} {100 * probability:.0f} %" in text


def test_no_range_is_an_answer_with_its_status(ranger: Ranger) -> None:
    reading = acquire(ranger, "s", lambda _: Finding(()))
    assert "no_points" in answer_text(reading).splitlines()[0]
    assert Depths.of(reading).scale > 0


@pytest.mark.parametrize("range_mm", [140.0, 800.0, 4000.0])
def test_intervals_and_contour_lie_in_the_plan_view_at_any_range(ranger: Ranger, range_mm: float) -> None:
    reading = reading_at(ranger, L1=range_mm, L2=range_mm, L3=range_mm, L4=range_mm)
    depths = Depths.of(reading)
    assert 0 < depths.scale <= 1
    for one in reading.lasers:
        near, far = depths.heights(interval_of(one))
        assert PLAN_HEIGHT / 2 > near > far > -PLAN_HEIGHT / 2
        assert near - far == pytest.approx(depths.scale * 4 * one.sigma_mm, rel=0.2)
    (line,) = reading.lines
    points = np.array(contour(line, ranger.sensor.front_mm(line.row, 0.0), depths))
    assert len(points) > 10
    assert (np.abs(points[:, 1]) < PLAN_HEIGHT / 2).all()


def test_a_plan_of_a_narrow_depth_is_true_to_scale(ranger: Ranger) -> None:
    """The slope of the drawn contour is that of the incline."""
    reading = reading_at(ranger, **INCLINE_MM)
    (line,) = reading.lines
    (x0, y0), *_, (x1, y1) = contour(line, ranger.sensor.front_mm(line.row, 0.0), Depths.of(reading))
    assert line.shape.angle_rad is not None
    assert (y0 - y1) / (x1 - x0) == pytest.approx(np.tan(line.shape.angle_rad), rel=0.02)


@pytest.mark.parametrize("ranges_mm", [{"L1": 800.0, "L2": 800.0, "L3": 800.0}, INCLINE_MM, {"L1": 4000.0}])
def test_the_bar_of_the_closest_point_spans_its_interval(ranger: Ranger, ranges_mm: dict[str, float]) -> None:
    reading = reading_at(ranger, **ranges_mm)
    depths = Depths.of(reading)
    ((x, first), (_, last)), *bars = closest_bar(reading, depths)
    (shape,) = (line.shape for line in reading.lines)
    assert x == shape.closest_x_mm
    assert [first, last] == depths.heights(shape.closest_interval_mm)
    heights = [start[1] for start, _ in bars]
    assert heights == sorted(heights, reverse=True)
    assert heights[1:2] == depths.heights([shape.closest_mm])


def test_there_is_no_bar_without_a_range(ranger: Ranger) -> None:
    assert closest_bar(acquire(ranger, "s", lambda _: Finding(())), Depths(0.0, 1.0)) == []


def test_readings_are_drawn_from_their_frames(ranger: Ranger, tmp_path: Path) -> None:
    reading = reading_at(ranger, L1=800.0, L2=800.0, L3=800.0, L4=800.0)
    dark = np.full((480, 640), 5, np.uint8)
    found = tuple(spots(ranger, {"L1": 800.0, "L2": 800.0, "L3": 800.0, "L4": 800.0}))

    def log(stream: Stream) -> None:
        view = RangerView(stream, a_rig(), ranger)
        for _ in range(3):
            view.take(Shown(reading, dark + np.uint8(10), dark, found))

    contents = logged(tmp_path, log)
    for origin in origins(ranger_layout(a_rig()).root_container):
        assert any(f"{entity}/".startswith(f"/{origin}/") for entity in contents.entities), origin
    values = contents.values("/history/closest", "Measurements:values")
    assert values == [(n, [reading.closest_mm]) for n in (1, 2, 3)]
    assert len(contents.values("/frame/image", "EncodedDepthImage:blob")) == 3
    ((_, labels), *_) = contents.values("/plan/spots", "Points2D:labels")
    assert [label.split()[0] for label in labels] == ["L1", "L2", "L3", "L4"]
