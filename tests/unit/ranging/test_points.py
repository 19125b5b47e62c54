"""Points that a shape is fitted to, and the interval of a range."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from tests.support.statistics import spread
from workbench.ranging.points import COVERAGE_FACTOR, Points, interval_mm, probabilities


@pytest.mark.parametrize("relative", [0.02, 0.1, 0.2])
def test_the_interval_of_a_far_range_holds_it(relative: float) -> None:
    """Gaussian in inverse depth: 95 % in the interval, an equal share beyond either end."""
    rng = np.random.default_rng(5)
    true, offset, n = 5000.0, 40.0, 20_000
    depth = 1.0 / (1.0 / (true + offset) + rng.normal(0.0, relative / (true + offset), n))
    depth = depth[depth > 0]
    sigma = relative / (true + offset) * depth**2
    ends = np.array([interval_mm(d - offset, s, offset) for d, s in zip(depth, sigma, strict=True)])
    assert np.mean(ends[:, 0] > true) == pytest.approx(0.025, abs=spread(0.025, n))
    assert np.mean(ends[:, 1] < true) == pytest.approx(0.025, abs=spread(0.025, n))
    symmetric_misses_far_side = np.mean(depth - offset + 1.96 * sigma < true)
    if relative >= 0.1:
        assert symmetric_misses_far_side > 0.035


def test_an_interval_may_have_no_far_end() -> None:
    assert interval_mm(5000.0, 2600.0)[1] == np.inf


def test_points_that_cannot_be() -> None:
    with pytest.raises(ValueError, match="different positions"):
        Points(np.zeros(2), np.full(2, 500.0), np.eye(2))
    with pytest.raises(ValueError, match="in front of the pinhole"):
        Points(np.arange(2.0), np.array([500.0, 20.0]), np.eye(2), offset_mm=-30.0)


@pytest.mark.parametrize(("range_mm", "offset_mm"), [(500.0, 0.0), (500.0, 40.0), (80.0, -20.0)])
@pytest.mark.parametrize("relative", [1e-4, 0.05, 0.3])
def test_ends_of_an_interval_are_symmetric_in_inverse_depth(
    range_mm: float, offset_mm: float, relative: float
) -> None:
    depth = range_mm + offset_mm
    sigma = relative * depth
    nearest, farthest = (end + offset_mm for end in interval_mm(range_mm, sigma, offset_mm))
    step = stats.norm.ppf(0.975) * sigma / depth**2
    assert 1 / nearest == pytest.approx(1 / depth + step)
    assert 1 / farthest == pytest.approx(1 / depth - step)
    assert stats.norm.cdf(COVERAGE_FACTOR) == pytest.approx(0.975)


def test_without_an_offset_the_pinhole_lies_in_the_reference_plane() -> None:
    assert interval_mm(500.0, 30.0) == interval_mm(500.0, 30.0, 0.0)
    assert interval_mm(0.0, 1.0) == (0.0, np.inf)


def test_behind_the_pinhole_anything_before_it_is_possible() -> None:
    assert interval_mm(-30.0, 1.0, 20.0) == (-20.0, np.inf)
    assert interval_mm(-20.0, 1.0, 20.0) == (-20.0, np.inf)


def test_what_is_exact_has_a_covariance_of_zeros() -> None:
    points = Points(np.arange(2.0), np.full(2, 500.0), np.eye(2))
    ranges, places, cross = points.covariances
    np.testing.assert_array_equal(ranges, np.eye(2))
    np.testing.assert_array_equal(places, np.zeros((2, 2)))
    np.testing.assert_array_equal(cross, np.zeros((2, 2)))
    assert len(points) == 2


@pytest.mark.parametrize(
    ("x", "ranges", "n"),
    [([], [], 0), ([1.0, 2.0], [500.0], 2), ([1.0, 2.0], [500.0, 500.0], 3)],
)
def test_shapes_of_points_agree(x: list[float], ranges: list[float], n: int) -> None:
    with pytest.raises(ValueError, match="expected"):
        Points(np.array(x), np.array(ranges), np.eye(n))


def test_a_fit_without_freedom_has_no_probability() -> None:
    none, some = probabilities([0.0, 3.2], [0, 2])
    assert none is None
    assert some == pytest.approx(stats.chi2.sf(3.2, 2))
    assert probabilities([], []) == []
