"""Geometry of the sensor for drawing: lines of sight, rays, and what a fit replaces."""

from __future__ import annotations

from math import radians, tan

import numpy as np

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
