"""Stated surfaces of scanned targets, and deviations from them."""

from __future__ import annotations

from math import cos, radians, tan

import numpy as np
import pytest

from workbench.model.prior import Prior
from workbench.model.rig import BenchSpec
from workbench.model.target import CylinderTarget, FlatTarget, NoTarget, Placement, PolynomialTarget
from workbench.trials.scanning.surface import deviations, outline

BENCH = BenchSpec(
    placement_sd_mm=0.4, tilt_sd_deg=0.0, target_tilt_sd_deg=0.0, ruler_scale=Prior(value=0.0, sd=0.001)
)


def placed(target: FlatTarget | CylinderTarget | PolynomialTarget | NoTarget) -> Placement:
    return Placement(key="p", standoff_mm=500.0, target=target)


def test_a_flat_is_left_along_its_normal() -> None:
    target = placed(FlatTarget(yaw_deg=30.0))
    point = np.array([[100.0, 7.0, 500.0 + 100.0 * tan(radians(30.0)) + 2.0]])
    found = deviations(target, BENCH, point)
    assert found.mm[0] == pytest.approx(2.0 * cos(radians(30.0)))
    np.testing.assert_allclose(found.normal[0], [-0.5, 0.0, cos(radians(30.0))], atol=1e-12)
    assert found.reference_sd_mm[0] == pytest.approx(np.hypot(0.4, 0.5) * cos(radians(30.0)))


def test_the_tilt_of_a_flat_counts_with_its_distance_from_the_axis() -> None:
    bench = BENCH.model_copy(update={"tilt_sd_deg": 0.3, "target_tilt_sd_deg": 0.4, "target_yaw_deg": 1.0})
    points = np.array([[0.0, 0.0, 500.0], [200.0, 0.0, 500.0 + 200.0 * tan(radians(1.0))]])
    found = deviations(placed(FlatTarget()), bench, points)
    np.testing.assert_allclose(found.mm, 0.0, atol=1e-9)
    tilt_mm = radians(0.5) * 200.0
    assert found.reference_sd_mm[1] == pytest.approx(np.hypot(np.hypot(0.4, 0.5), tilt_mm), rel=1e-3)
    assert found.reference_sd_mm[0] == pytest.approx(np.hypot(0.4, 0.5), rel=1e-3)


def test_only_the_measured_angle_of_a_turned_flat_has_the_uncertainty_of_its_measurement() -> None:
    bench = BENCH.model_copy(update={"placement_sd_mm": 0.0, "tilt_sd_deg": 0.5})
    exact = Prior(value=0.0, sd=0.0)
    target = placed(FlatTarget(pitch_deg=20.0, turn_sd_deg=0.05))
    points = np.array([[200.0, 0.0, 500.0], [0.0, 200.0, 500.0 + 200.0 * tan(radians(20.0))]])
    found = deviations(target, bench.model_copy(update={"ruler_scale": exact}), points)
    by_yaw, by_pitch = 200.0 * radians(0.5), 200.0 * radians(0.05) / cos(radians(20.0)) ** 2
    expected = np.array([by_yaw, by_pitch]) * cos(radians(20.0))
    np.testing.assert_allclose(found.reference_sd_mm, expected, rtol=1e-9)


def test_a_cylinder_is_left_along_its_radius() -> None:
    target = placed(CylinderTarget(diameter_mm=200.0, shift_mm=20.0))
    angle = radians(40.0)
    on = np.array([20.0 - 100.0 * np.sin(angle), 0.0, 600.0 - 100.0 * np.cos(angle)])
    out = on + 3.0 * np.array([np.sin(angle), 0.0, np.cos(angle)])  # into the cylinder: farther
    found = deviations(target, BENCH, np.array([on, out]))
    np.testing.assert_allclose(found.mm, [0.0, 3.0], atol=1e-9)
    assert found.reference_sd_mm[0] == pytest.approx(np.hypot(0.4, 0.5) * np.cos(angle))


def test_a_polynomial_is_left_along_its_normal_to_first_order() -> None:
    target = placed(PolynomialTarget(coefficients=(0.5, 0.002), shift_mm=10.0))
    x = 60.0
    on = 500.0 + 0.5 * 50.0 + 0.002 * 50.0**2
    slope = 0.5 + 2 * 0.002 * 50.0
    found = deviations(target, BENCH, np.array([[x, 0.0, on], [x, 0.0, on + 0.1]]))
    np.testing.assert_allclose(found.mm, [0.0, 0.1 / np.hypot(1, slope)], atol=1e-9)


@pytest.mark.parametrize(
    "target",
    [
        FlatTarget(yaw_deg=10.0),
        CylinderTarget(diameter_mm=178.0),
        PolynomialTarget(coefficients=(0.1, 0.001)),
    ],
)
def test_the_outline_lies_on_the_surface(target: FlatTarget | CylinderTarget | PolynomialTarget) -> None:
    x, along = outline(placed(target), BENCH, (-150.0, 120.0))
    assert len(x) > 100
    points = np.column_stack([x, np.zeros_like(x), along])
    np.testing.assert_allclose(deviations(placed(target), BENCH, points).mm, 0.0, atol=1e-9)


def test_a_target_without_surface_is_refused() -> None:
    with pytest.raises(TypeError, match="got none"):
        deviations(placed(NoTarget()), BENCH, np.zeros((1, 3)))
