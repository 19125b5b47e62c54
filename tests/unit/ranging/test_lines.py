"""The shape before one line of lasers, and the mean of lines, with their deviations."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.rangers import IDS, X_MM, positions, ranger_in
from tests.support.rigs import World, thesis_rig
from workbench.ranging.ranger import Ranger


@pytest.mark.parametrize("angle_deg", [-60.0, 0.0, 60.0])
def test_the_mean_of_one_line_is_known_as_well_as_the_line(ranger: Ranger, angle_deg: float) -> None:
    """Pointing and baselines put the spots elsewhere along an incline, which moves its closest range."""
    at = zip(IDS, X_MM, strict=True)
    incline = {i: 600.0 + np.tan(np.radians(angle_deg)) * x for i, x in at}
    reading = ranger.read_known("s", 4, IDS, positions(ranger, incline), np.full((4, 2), 0.03))
    assert reading.lines[0].shape.kind == ("incline" if angle_deg else "flat")
    assert reading.mean_mm == reading.closest_mm
    assert reading.mean_sigma_mm == pytest.approx(reading.sigma_mm, rel=1e-4)


def test_the_mean_of_a_cylinder_s_line_is_known_as_well_as_the_line(ranger: Ranger) -> None:
    at = zip(IDS, X_MM, strict=True)
    tube = {i: 300.0 - np.sqrt(75.0**2 - (x - 4.0) ** 2) for i, x in at}
    reading = ranger.read_known("s", 4, IDS, positions(ranger, tube), np.full((4, 2), 0.03))
    assert reading.lines[0].shape.kind == "cylinder"
    assert reading.mean_sigma_mm == pytest.approx(reading.sigma_mm, rel=1e-4)


def test_angle_and_closest_range_lie_where_stated_whatever_the_calibration() -> None:
    """50 rigs, calibrated once each, before a wall turned by 30 degrees: pointing and lens are in sigma."""
    angle, closest = [], []
    for seed in range(300, 350):
        world = World(thesis_rig(), seed)
        ranger = ranger_in(world)
        yaw, z0 = np.radians(30.0), 600.0 + world.values["offset_mm"]
        noise = np.random.default_rng([seed, 5]).normal(0.0, 0.05, (4, 2))  # 0.03 px and the speckle's 0.04
        pixels = np.array([world.pixel(i, z0, yaw) for i in IDS]) + noise
        reading = ranger.read_known("s", 4, IDS, pixels, np.full((4, 2), 0.03))
        shape = reading.lines[0].shape
        if shape.kind == "incline" and shape.angle_rad is not None and shape.angle_sigma_rad is not None:
            angle.append((shape.angle_rad - yaw) / shape.angle_sigma_rad)
            true = 600.0 + np.tan(yaw) * world.values["L1.x_mm"]
            closest.append((shape.closest_mm - true) / shape.closest_sigma_mm)
    assert len(angle) >= 46
    for z in (np.array(angle), np.array(closest)):
        # Of n standard normals the mean is known to 1 / sqrt(n), that of their squares to sqrt(2 / n).
        assert (z**2).mean() == pytest.approx(1.0, abs=3.5 * np.sqrt(2 / len(z)))
        assert abs(z.mean()) < 3.5 / np.sqrt(len(z))
