"""True ranges of a flat target, and their uncertainties."""

from __future__ import annotations

from math import hypot, radians, tan

import numpy as np
import pytest

from tests.support.rigs import prior
from workbench.model.rig import BenchSpec
from workbench.model.target import Placement
from workbench.trials.reference import Reference, near_end, true_ranges_mm

PLACED = Placement(key="t/1", standoff_mm=500.0, standoff_sd_mm=0.3)
LINE = ((-60.0, 0.0), (60.0, 0.0))
ONE_SIDE = ((30.0, 0.0), (60.0, 0.0))
CROSS = (*LINE, (0.0, -50.0), (0.0, 20.0))
DRAWS = 100_000


def test_scale_and_slopes_change_the_true_range() -> None:
    places = np.array([[0.0, 0.0], [60.0, 0.0], [0.0, -30.0]])
    found = true_ranges_mm(1000.0, (0.003, 0.01, 0.02), places)
    assert found == pytest.approx([1003.0, 1003.6, 1002.4])


def test_the_reference_of_a_bench_contains_its_ruler_and_its_rail() -> None:
    bench = BenchSpec(ruler_scale=prior(0.003, 0.0005), target_yaw_deg=2.0, target_pitch_deg=-1.0)
    reference = Reference.of(bench, PLACED)
    point = reference.at_point((60.0, 20.0))
    expected_mm = 501.5 + 60.0 * tan(radians(2.0)) - 20.0 * tan(radians(1.0))
    assert reference.true_mm(point) == pytest.approx(expected_mm)


def test_the_uncertainty_contains_placement_tilts_and_scale() -> None:
    bench = BenchSpec(ruler_scale=prior(0.0, 0.001), tilt_sd_deg=0.5, target_tilt_sd_deg=0.2)
    reference = Reference.of(bench, PLACED)
    axis, end = reference.at_point((0.0, 0.0)), reference.at_point((0.0, -60.0))
    assert reference.own_sd_mm(axis) == pytest.approx(0.3)
    assert reference.sd_mm(axis) == pytest.approx(hypot(0.3, 0.5))
    assert reference.own_sd_mm(end) == pytest.approx(hypot(0.3, 60 * radians(0.5)))
    assert reference.sd_mm(end) == pytest.approx(hypot(0.3, 0.5, 60 * radians(0.5), 60 * radians(0.2)))


@pytest.mark.parametrize("ends", [LINE, ONE_SIDE, CROSS])
@pytest.mark.parametrize("tilt", [(0.0, 0.0), (0.01, 0.0)])
@pytest.mark.parametrize("sds", [(0.005, 0.009), (0.009, 0.0), (0.0, 0.005)])
def test_the_near_end_is_that_of_drawn_tilts(
    ends: tuple[tuple[float, float], ...], tilt: tuple[float, float], sds: tuple[float, float]
) -> None:
    """Mean and variance over draws of two placements that share the common slopes."""
    random = np.random.default_rng(4)
    common = np.array(tilt) + sds[1] * random.standard_normal((DRAWS, 2))
    points = np.array(ends).T
    one, other = (
        ((common + sds[0] * random.standard_normal((DRAWS, 2))) @ points).min(axis=1) for _ in range(2)
    )
    found = near_end(ends, tilt, *sds)
    sd_mm = float(one.std())
    # 0.02 sd: NODES; 5 standard deviations of the mean over DRAWS are 0.016 sd, of a covariance 0.02 sd^2.
    assert found.shift_mm == pytest.approx(float(one.mean()), abs=0.036 * sd_mm)
    assert found.sd_mm == pytest.approx(sd_mm, rel=0.04)
    shared = float(np.cov(one, other)[0, 1])
    assert found.common_mm[0] ** 2 == pytest.approx(shared, abs=0.07 * sd_mm**2)


def test_the_near_end_of_a_line_is_closer_by_eight_tenths_of_the_tilt() -> None:
    found = near_end(LINE, (0.0, 0.0), 0.006, 0.008)
    assert found.shift_mm == pytest.approx(-np.sqrt(2 / np.pi) * 0.6, rel=0.02)
    assert found.sd_mm == pytest.approx(np.sqrt(1 - 2 / np.pi) * 0.6, rel=0.02)
