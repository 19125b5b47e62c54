"""Running time of captures: without the time between parts, by order where there are no times."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.calibration.data.capture_times import NO_TIMES, CaptureTimes


def test_times_of_one_part_keep_their_pauses() -> None:
    found = CaptureTimes.of(np.array([100.0, 102.0, 108.0, 110.0]), [""] * 4)
    np.testing.assert_allclose(found.time, [-0.5, -0.3, 0.3, 0.5])
    np.testing.assert_allclose(found.limits, [[-0.5, 0.5]])
    assert found.duration_s == pytest.approx(10.0)


def test_the_time_between_parts_does_not_count() -> None:
    """Two parts of 6 and 4 s, a day apart and given in the order of capture."""
    found = CaptureTimes.of(np.array([0.0, 6.0, 86400.0, 86404.0]), ["", "", "1", "1"])
    np.testing.assert_allclose(found.time, [-0.5, 0.1, 0.1, 0.5])
    np.testing.assert_allclose(found.limits, [[-0.5, 0.1], [0.1, 0.5]])
    assert found.part.tolist() == [0, 0, 1, 1]
    assert found.duration_s == pytest.approx(10.0)


def test_the_zero_of_each_part_is_its_own() -> None:
    shifted = CaptureTimes.of(np.array([7.0, 13.0, 0.0, 4.0]), ["a", "a", "b", "b"])
    np.testing.assert_allclose(shifted.time, [-0.5, 0.1, 0.1, 0.5])


@pytest.mark.parametrize("time_s", [[np.nan] * 5, [0.0, 1.0, np.nan, 3.0, 4.0], [7.0] * 5])
def test_without_times_the_order_counts(time_s: list[float]) -> None:
    found = CaptureTimes.of(np.array(time_s), ["", "", "1", "1", "1"])
    np.testing.assert_allclose(found.time, [-0.5, -0.25, 0.0, 0.25, 0.5])
    np.testing.assert_allclose(found.limits, [[-0.5, -0.25], [0.0, 0.5]])
    assert np.isnan(found.duration_s)


def test_no_captures_have_no_parts() -> None:
    assert NO_TIMES.limits.shape == (0, 2)
