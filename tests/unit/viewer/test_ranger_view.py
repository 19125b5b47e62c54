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
    RangerView,
    Shown,
    answer_text,
    contour,
    plan_scale,
    ranger_layout,
)
from workbench.viewer.stream import Stream


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
    assert reading.lines[0].shape.kind in text


def test_no_range_is_an_answer_with_its_status(ranger: Ranger) -> None:
    reading = acquire(ranger, "s", lambda _: Finding(()))
    assert "no_points" in answer_text(reading).splitlines()[0]
    assert plan_scale(reading) > 0


@pytest.mark.parametrize("range_mm", [140.0, 800.0, 4000.0])
def test_spots_and_contour_lie_in_the_plan_view_at_any_range(ranger: Ranger, range_mm: float) -> None:
    reading = reading_at(ranger, L1=range_mm, L2=range_mm, L3=range_mm, L4=range_mm)
    scale = plan_scale(reading)
    for one in reading.lasers:
        assert 0 < scale * one.range_mm < PLAN_HEIGHT
    (line,) = reading.lines
    points = np.array(contour(line, ranger.sensor.front_mm(line.axis), scale))
    assert len(points) > 10
    assert (points[:, 1] < 0).all()
    assert (points[:, 1] > -PLAN_HEIGHT).all()
    assert abs(points[:, 1].mean() + scale * range_mm) < 0.05 * PLAN_HEIGHT


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
