"""Charts, words and geometry on their own."""

from __future__ import annotations

from math import radians, tan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.rigs import fisheye_rig
from tests.viewer.session import a_fit, a_rig
from workbench.model.target import FlatTarget
from workbench.viewer.chart import HEIGHT, WIDTH, Chart, Mark, y_ticks
from workbench.viewer.documents import plus_minus
from workbench.viewer.entities import laser_colors, under
from workbench.viewer.geometry import Geometry


@given(limit=st.floats(1e-6, 1e6))
def test_ticks_are_few_symmetric_and_within(limit: float) -> None:
    ticks = y_ticks(limit)
    assert 3 <= len(ticks) <= 11
    assert 0.0 in ticks
    assert ticks == [-tick for tick in reversed(ticks)]
    assert max(ticks) <= limit * (1 + 1e-9)


@given(
    marks=st.lists(
        st.builds(
            Mark,
            series=st.sampled_from(["L1", "stranger"]),
            standoff_mm=st.floats(10.0, 1e4),
            y=st.floats(-1e3, 1e3),
            sd=st.none() | st.floats(0.0, 1e3),
        ),
        min_size=1,
    )
)
def test_every_mark_lies_on_the_plot(marks: list[Mark]) -> None:
    chart = Chart("px", marks, {"L1": (1, 2, 3)})
    for mark in marks:
        x, y = chart.place(mark)
        assert 0 < x < WIDTH
        assert 0 < y < HEIGHT


@pytest.mark.parametrize(
    ("y", "sd", "outlier"), [(0.31, 0.1, True), (-0.31, 0.1, True), (0.29, 0.1, False), (9.0, None, False)]
)
def test_outliers_are_beyond_three_sigma(y: float, sd: float | None, outlier: bool) -> None:
    assert Mark("L1", 500.0, y, 0.01, expected_sd=sd).is_outlier is outlier


@pytest.mark.parametrize(
    ("value", "sd", "text"),
    [
        (541.234, 22.0, "541 ± 22"),
        (358.21, 2.14, "358.2 ± 2.1"),
        (0.00112, 0.0008, "0.00112 ± 0.00080"),
        (-60.0, 0.0, "-60 (fixed)"),
        (-0.001, 0.5, "0.00 ± 0.50"),
    ],
)
def test_values_are_written_to_the_second_digit_of_their_sd(value: float, sd: float, text: str) -> None:
    assert plus_minus(value, sd) == text


def test_sight_and_ray_meet_on_the_target() -> None:
    geometry = Geometry.of_rig(a_rig())
    target = FlatTarget(yaw_deg=8.0, pitch_deg=3.0)
    z = 900.0 + tan(radians(8.0)) * -60.0
    u = 319.5 + 533.3 * -60.0 / z
    (point,) = geometry.seen_on(target, 900.0, np.array([[u, 239.5]]))
    np.testing.assert_allclose(point, [-60.0, 0.0, z], atol=1e-9)
    np.testing.assert_allclose(geometry.ray_at("L1", z), point, atol=1e-9)


def test_sight_and_ray_meet_on_the_target_of_a_fisheye() -> None:
    """56 degrees off the axis the picture has 0.98 radians times f."""
    geometry = Geometry.of_rig(fisheye_rig())
    u = 319.5 + 305.6 * np.arctan(-60.0 / 40.0)
    (point,) = geometry.seen_on(FlatTarget(), 40.0, np.array([[u, 239.5]]))
    np.testing.assert_allclose(point, [-60.0, 0.0, 40.0], atol=1e-9)
    assert geometry.seen_on(FlatTarget(), 40.0, np.empty((0, 2))).shape == (0, 3)


def test_fit_replaces_what_it_names_and_nothing_else() -> None:
    before = Geometry.of_rig(a_rig())
    after = before.fitted(a_fit().parameters)
    assert after.lens["f_px"] == 541.0
    assert after.lens["k1"] == before.lens["k1"]
    assert after.rays["L1"] == (-59.95, 0.0, 0.0011, 0.0)


def test_lasers_have_colors_of_their_own_and_names_may_be_odd() -> None:
    colors = laser_colors([str(i) for i in range(7)])
    assert len(set(colors.values())) == 7
    assert under("spots/u_px", "left / 650 nm") == "spots/u_px/left\\ \\/\\ 650\\ nm"
