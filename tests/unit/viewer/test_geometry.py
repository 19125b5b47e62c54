"""Geometry of the sensor for drawing: lines of sight, rays, and what a fit replaces."""

from __future__ import annotations

from math import radians, tan

import numpy as np
import pytest

from tests.support.rigs import fisheye_rig
from tests.viewer.session import a_fit, a_rig
from workbench.model.target import FlatTarget
from workbench.viewer.geometry import Geometry


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


@pytest.mark.parametrize(
    "target", [FlatTarget(), FlatTarget(yaw_deg=30.0), FlatTarget(yaw_deg=12.0, pitch_deg=-20.0)]
)
@pytest.mark.parametrize("standoff_mm", [140.0, 900.0, 3800.0])
def test_the_expected_spot_is_seen_where_the_ray_meets_the_target(
    target: FlatTarget, standoff_mm: float
) -> None:
    """Against the line of sight and the intersection of plane and ray by linear equations."""
    geometry = Geometry.of_rig(a_rig()).fitted(a_fit().parameters)
    spot = geometry.spot_on("L4", target, standoff_mm)
    (seen,) = geometry.seen_on(target, standoff_mm, spot[None])
    x, y, tx, ty = geometry.rays["L4"]
    normal = np.array([-tan(radians(target.yaw_deg)), -tan(radians(target.pitch_deg)), 1.0])
    exit_mm, way = np.array([x, y, 0.0]), np.array([tx, ty, 1.0])
    depth = (standoff_mm + geometry.offset_mm - normal @ exit_mm) / (normal @ way)
    np.testing.assert_allclose(seen, exit_mm + depth * way, rtol=1e-7, atol=1e-6)


def test_a_scanline_has_the_spots_at_both_ends_of_the_reach() -> None:
    geometry = Geometry.of_rig(a_rig())
    ends = geometry.scanline("L1", (200.0, 4000.0))
    expected = [(319.5 + 533.3 * -60.0 / z, 239.5) for z in (200.0, 4000.0)]
    np.testing.assert_allclose(ends, expected, atol=1e-9)
