"""The shape before one line of lasers, and the mean of lines, with their deviations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.support.rangers import IDS, X_MM, positions, ranger_in
from tests.support.rigs import World, thesis_rig
from tests.support.surfaces import X, flat, incline, seen
from workbench.optics.rows import Row
from workbench.ranging.lines import LineShape, fit_line, mean_of_lines
from workbench.ranging.ranger import Ranger
from workbench.ranging.shape import fit_shape
from workbench.sensor.calibrated import CalibratedSensor


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


@pytest.mark.thorough
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


HORIZONTAL, VERTICAL = Row((0, 1, 2, 3), 0), Row((4, 5, 6, 7), 90)


def line(row: Row, range_mm: float, spot_sd_mm: float, by_parameter: float) -> LineShape:
    """A line whose closest range rests on one spot and one parameter of the calibration."""
    shape = replace(fit_shape(seen(X, flat(range_mm)(X))), closest_sigma_mm=spot_sd_mm)
    return LineShape(row, shape, (0,), np.array([by_parameter]), np.array([spot_sd_mm]))


def test_lines_are_weighted_by_information_or_by_pixels() -> None:
    lines, variance = [line(HORIZONTAL, 500.0, 1.0, 1.0), line(VERTICAL, 506.0, 2.0, 1.0)], np.zeros((1, 1))
    near, far = (one.shape.closest_mm for one in lines)
    mean, sigma = mean_of_lines(lines, variance, "information", (640, 480))
    assert mean == pytest.approx((near + far / 4) / 1.25)
    assert sigma == pytest.approx(np.sqrt(1 / 1.25))
    mean, sigma = mean_of_lines(lines, variance, "pixels", (640, 480))
    assert mean == pytest.approx((640 * near + 480 * far) / 1120)
    assert sigma == pytest.approx(np.hypot(640 * 1.0, 480 * 2.0) / 1120)


@pytest.mark.parametrize(("other", "expected"), [(1.0, 3.0), (-1.0, 0.0)])
def test_an_error_of_the_calibration_is_common_to_the_lines(other: float, expected: float) -> None:
    """It stays in the mean where it has the same sign in both, and goes where it has not."""
    lines = [line(HORIZONTAL, 500.0, 1e-9, 1.0), line(VERTICAL, 500.0, 1e-9, other)]
    _, sigma = mean_of_lines(lines, np.array([[9.0]]), "information", (640, 480))
    assert sigma == pytest.approx(expected, abs=1e-6)


def test_the_uncertainty_of_a_shape_is_that_of_its_line() -> None:
    """What neither spots nor calibration explain is averaged over two lines."""
    rows = (HORIZONTAL, VERTICAL)
    lines = [replace(line(row, 500.0, 3.0, 0.0), closest_spot_sd_mm=np.zeros(1)) for row in rows]
    _, sigma = mean_of_lines(lines, np.zeros((1, 1)), "information", (640, 480))
    assert sigma == pytest.approx(3.0 / np.sqrt(2.0))


@pytest.mark.parametrize("name", ["L2.x_mm", "L3.tx", "f_px", "k1", "offset_mm"])
def test_derivatives_of_the_closest_range_by_the_calibration_are_those_of_differences(
    ranger: Ranger, name: str
) -> None:
    """The same spots, ranged and fitted with one parameter moved."""
    at = zip(IDS, incline(500.0, 30.0)(X), strict=True)
    pixels, sd = positions(ranger, dict(at)), np.full((4, 2), 0.03)
    sensor, names = ranger.sensor, ranger.calibration.laser_ranger.parameters.names
    value, step = ranger.calibration.geometry()[name], {"f_px": 1e-2}.get(name, 1e-4)

    def closest(moved: CalibratedSensor) -> LineShape:
        return fit_line(moved, moved.rows[0], IDS, moved.ranges(IDS, pixels, sd), range(4))

    ahead, back = (
        closest(CalibratedSensor(ranger.calibration, {name: value + sign * step})).shape.closest_mm
        for sign in (1, -1)
    )
    found = closest(sensor).closest_by_parameter
    scale = np.abs(found).max() if name in ("f_px", "offset_mm") else abs(found[names.index(name)])
    assert found[names.index(name)] == pytest.approx((ahead - back) / (2 * step), rel=0.02, abs=1e-3 * scale)
