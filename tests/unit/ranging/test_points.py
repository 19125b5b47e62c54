"""Points that a shape is fitted to, and the interval of a range."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.statistics import spread
from workbench.ranging.points import Points, interval_mm


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
    with pytest.raises(ValueError, match="all differ"):
        Points(np.zeros(2), np.full(2, 500.0), np.eye(2))
    with pytest.raises(ValueError, match="before the pinhole"):
        Points(np.arange(2.0), np.array([500.0, 20.0]), np.eye(2), offset_mm=-30.0)
