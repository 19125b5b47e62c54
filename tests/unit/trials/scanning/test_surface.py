"""Stated surfaces of scanned targets, and deviations from them."""

from __future__ import annotations

from dataclasses import replace
from math import cos, radians, tan

import numpy as np
import pytest

from workbench.model.prior import Prior
from workbench.model.rig import BenchSpec
from workbench.model.target import CylinderTarget, FlatTarget, NoTarget, Placement, PolynomialTarget
from workbench.sensor.scanning import ScanPoints
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
    assert found.reference_sd_mm[0] == pytest.approx(np.hypot(0.4, 0.5 * np.cos(angle)))


@pytest.mark.parametrize("angle_deg", [-70.0, -30.0, 0.0, 50.0])
@pytest.mark.parametrize("diameter_sd_mm", [None, 2.0])
def test_cylinders_drawn_as_placed_scatter_as_stated(angle_deg: float, diameter_sd_mm: float | None) -> None:
    """Placed with an error along x and one along z, by a ruler with an error, and of another diameter."""
    draws, angle = 20_000, radians(angle_deg)
    target = placed(CylinderTarget(diameter_mm=200.0, shift_mm=20.0, diameter_sd_mm=diameter_sd_mm))
    on = np.array([20.0 - 100.0 * np.sin(angle), 0.0, 600.0 - 100.0 * np.cos(angle)])
    stated_mm = deviations(target, BENCH, on[None]).reference_sd_mm[0]
    random = np.random.default_rng(1)
    radius = 100.0 + random.normal(0.0, (diameter_sd_mm or 0.0) / 2, draws)
    x = 20.0 + random.normal(0.0, 0.4, draws)
    z = 500.0 * (1 + random.normal(0.0, 0.001, draws)) + random.normal(0.0, 0.4, draws) + radius
    left_mm = radius - np.hypot(on[0] - x, on[2] - z)
    assert left_mm.std() == pytest.approx(stated_mm, rel=4 / np.sqrt(2 * draws) + 0.003)
    assert abs(left_mm.mean()) < 4.5 * stated_mm / np.sqrt(draws) + 0.01


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_errors_that_calibration_and_surface_share_count_once(seed: int) -> None:
    """A linear world: two parameters of a sensor and the three shared ones are estimated from four data."""
    random = np.random.default_rng(seed)
    bench = BENCH.model_copy(update={"target_tilt_sd_deg": 0.5})
    target = placed(FlatTarget(yaw_deg=20.0))
    on = np.array([[x, 10.0, 500.0 + x * tan(radians(20.0))] for x in (-200.0, 0.0, 150.0)])
    found = replace(deviations(target, bench, on), own_sd_mm=np.zeros(3))
    prior_sd = np.concatenate([[1.0, 2.0], found.shared_sd])
    by_data = random.normal(size=(4, 5)) / prior_sd
    posterior = np.linalg.inv(np.diag(prior_sd**-2.0) + by_data.T @ by_data)
    common = random.normal(size=(3, 3, 2))
    points = ScanPoints(
        position_mm=on,
        covariance_mm2=common @ posterior[:2, :2] @ common.transpose(0, 2, 1),
        common=common,
        own_covariance_mm2=np.zeros((3, 3, 3)),
        across_sd=np.zeros(3),
    )
    draws = 20_000
    true = prior_sd * random.normal(size=(draws, 5))
    data = true @ by_data.T + random.normal(size=(draws, 4))
    error = (data @ by_data @ posterior - true)[:, :2]
    left = np.einsum("ni,nip,dp->dn", found.normal, common, error) + true[:, 2:] @ found.by_shared.T
    stated = found.sd_mm(points, posterior[2:, :2])
    np.testing.assert_allclose(left.std(axis=0), stated, rtol=4.5 / np.sqrt(2 * draws))


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
