"""Scanning head: the turned ray, and the thesis's formula for it (figure 43)."""

from __future__ import annotations

from math import radians, tan

import numpy as np
import pytest

from workbench.emulator.head import turned
from workbench.emulator.truth import TrueHead, TrueRay
from workbench.model.head_calibration import HEAD
from workbench.optics.head import Head, beam_angle, turned_ray
from workbench.optics.rays import Plane, Ray, depth_on_plane

PERFECT = Head(*np.zeros(len(HEAD)))
F_MM, SENSOR_MM, IMAGE_PX = 3.6, 4.8, 640
"""Of the thesis's simulation."""


def numbers(ray: Ray) -> list[float]:
    """Origin x, y and direction tx, ty."""
    return [float(np.asarray(part)) for part in ray]


@pytest.mark.parametrize("seed", range(5))
def test_the_turned_ray_is_that_of_the_virtual_bench(seed: int) -> None:
    """The virtual bench turns the whole beam by rotation vectors."""
    random = np.random.default_rng(seed)
    head = TrueHead("S", *random.normal(0, [5, 0.03, 0.03, 1, 0.01, 0.5, 0.5, 0.0]))
    ray = TrueRay(90.0, 3.0, *random.normal(0, 0.05, 2))
    model = Head(
        head.axis_z_mm,
        head.axis_slope_x,
        head.axis_slope_z,
        head.beam_offset_mm,
        head.scale,
        radians(head.eccentricity_cos_deg),
        radians(head.eccentricity_sin_deg),
    )
    for reading_deg in (-60.0, -7.0, 0.0, 30.0):
        true = turned(ray, head, reading_deg)
        found = turned_ray(Ray(ray.x_mm, ray.y_mm, ray.tx, ray.ty), model, radians(reading_deg))
        expected = (true.x_mm, true.y_mm, true.tx, true.ty)
        np.testing.assert_allclose(np.array(found), expected, rtol=1e-12, atol=1e-12)


def test_at_the_reading_0_the_beam_has_the_direction_of_its_entry() -> None:
    head = PERFECT._replace(scale=0.1, eccentricity_cos_rad=0.2, eccentricity_sin_rad=0.3)
    assert float(beam_angle(Ray(90.0, 0.0, 0.02, 0.0), head, 0.0)) == pytest.approx(np.arctan(0.02))
    ray = turned_ray(Ray(90.0, 2.0, 0.02, 0.01), PERFECT, 0.0)
    assert numbers(ray) == pytest.approx([90.0, 2.0, 0.02, 0.01 * np.hypot(1, 0.02)])


@pytest.mark.parametrize("angle_deg", [-25.0, 0.0, 15.0])
@pytest.mark.parametrize("range_mm", [200.0, 1500.0])
def test_the_thesis_formula_holds_with_the_displacement_on_the_sensor(
    angle_deg: float, range_mm: float
) -> None:
    """r = dw / (dx / f - tan theta): theta positive away from the camera, axis at the pinhole's depth."""
    dw_mm = 90.0
    ray = turned_ray(Ray(dw_mm, 0.0, 0.0, 0.0), PERFECT, radians(angle_deg))
    depth = float(depth_on_plane(ray, Plane(range_mm)))
    x_mm, _, tx, _ = numbers(ray)
    spot_x_mm = x_mm + tx * depth
    assert spot_x_mm == pytest.approx(dw_mm + range_mm * tan(radians(angle_deg)))  # dw + x
    dx_mm = F_MM * spot_x_mm / depth  # equation 4.1 of the thesis
    assert dw_mm / (dx_mm / F_MM - tan(radians(angle_deg))) == pytest.approx(range_mm)
    dp_px = dx_mm * IMAGE_PX / SENSOR_MM  # equation 4.2
    in_pixels = dw_mm / (dp_px * SENSOR_MM / (IMAGE_PX * F_MM) - tan(radians(angle_deg)))
    assert in_pixels == pytest.approx(range_mm)
    # As printed, with the thesis's own pw, the number of pixels across the image.
    printed_mm = dw_mm / (IMAGE_PX / F_MM - tan(radians(angle_deg)))
    assert printed_mm < 1.0
    # With the displacement in front of it the unit is still pixels.
    assert dw_mm / (dx_mm * IMAGE_PX / F_MM - tan(radians(angle_deg))) != pytest.approx(range_mm, rel=0.5)


def test_the_thesis_formula_lacks_the_depth_of_the_axis() -> None:
    """An axis 5 mm in front of the pinhole changes the range by z_a tan(theta) / dw."""
    dw_mm, depth_mm, angle = 90.0, 5.0, radians(-25.0)
    ray = turned_ray(Ray(dw_mm, 0.0, 0.0, 0.0), PERFECT._replace(axis_z_mm=depth_mm), angle)
    x_mm, _, tx, _ = numbers(ray)
    assert x_mm == pytest.approx(dw_mm - depth_mm * tan(angle))
    range_mm = float(depth_on_plane(ray, Plane(800.0)))
    sight = (x_mm + tx * range_mm) / range_mm
    of_thesis_mm = dw_mm / (sight - tan(angle))
    assert of_thesis_mm / range_mm - 1 == pytest.approx(depth_mm * tan(angle) / dw_mm, rel=0.03)
