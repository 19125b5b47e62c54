"""Geometry of the sensor for drawing: lines of sight, rays, and what a fit replaces."""

from __future__ import annotations

from math import radians, tan
from pathlib import Path

import numpy as np
import pytest

from tests.support.rigs import fisheye_rig
from tests.viewer.session import a_fit, a_rig
from workbench.model.calibration import load_calibration
from workbench.model.target import FlatTarget
from workbench.session.manifest import load_session_rig
from workbench.viewer.geometry import EXPECTED_SD, Geometry

DATA = Path(__file__).parents[3] / "data"


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


@pytest.mark.parametrize("target", [FlatTarget(), FlatTarget(yaw_deg=20.0)])
@pytest.mark.parametrize("standoff_mm", [300.0, 3000.0])
def test_the_ellipse_of_an_expected_spot_has_the_spread_of_drawn_sensors(
    target: FlatTarget, standoff_mm: float
) -> None:
    rig = a_rig()
    geometry = Geometry.of_rig(rig)
    priors = {**rig.camera.lens_priors, "offset_mm": rig.bench.offset_mm}
    priors |= {f"L1.{name}": getattr(rig.lasers[0], name) for name in ("x_mm", "y_mm", "tx", "ty")}
    random = np.random.default_rng(4)
    draws = [
        geometry.with_values({name: random.normal(one.value, one.sd) for name, one in priors.items()})
        for _ in range(400)
    ]
    spread = np.cov(np.array([one.spot_on("L1", target, standoff_mm) for one in draws]).T)
    outline = geometry.spot_ellipse("L1", target, standoff_mm)
    assert outline is not None
    offset = outline[:-1] - geometry.spot_on("L1", target, standoff_mm)
    # The mean square of the points of an ellipse is half its squared axes: 400 draws give 7 % of a variance.
    np.testing.assert_allclose(2 * np.mean(offset**2, axis=0) / EXPECTED_SD**2, np.diag(spread), rtol=0.3)


def test_after_a_fit_the_ellipse_waits_for_the_covariance_of_the_calibration() -> None:
    fitted = Geometry.of_rig(a_rig()).fitted(a_fit().parameters)
    assert fitted.spot_ellipse("L1", FlatTarget(), 500.0) is None
    calibration = load_calibration(DATA / "session-0.1.0/calibration.yaml")
    before = Geometry.of_rig(load_session_rig(DATA / "session-0.1.0"))
    wide = before.spot_ellipse("L1", FlatTarget(), 500.0)
    narrow = before.calibrated(calibration).spot_ellipse("L1", FlatTarget(), 500.0)
    assert wide is not None
    assert narrow is not None
    assert (np.ptp(narrow, axis=0) < 0.2 * np.ptp(wide, axis=0)).all()
