"""Points of a scan: exact without noise, and deviations that a simulation confirms."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.rigs import PROVENANCE
from tests.support.scanned_head import SimulatedHead
from workbench.calibration.scanning.export import calibrated_head
from workbench.calibration.scanning.fit import fit_head
from workbench.model.head_calibration import HEAD
from workbench.model.rig import load_rig
from workbench.optics.head import Head, turned_ray
from workbench.optics.rays import RAY, Ray
from workbench.sensor.scanning import CalibratedHead

RIG = load_rig(Path(__file__).parents[3] / "rigs/scanning-head-emulated.yaml")
READINGS_DEG = np.array([-28.0, -10.0, 0.0, 9.0])


@pytest.fixture(scope="module")
def scanned() -> tuple[SimulatedHead, CalibratedHead]:
    """A head, and a sensor with its true parameters."""
    exact = RIG.model_copy(update={"head": RIG.scanning_head.model_copy(update={"reading_sd_deg": 0.0})})
    head = SimulatedHead.of(exact, 11)
    spots = head.spots((300.0, 900.0), (0.0, 10.0, -10.0, -20.0), 0.05, np.random.default_rng(1))
    fit = fit_head(RIG, spots)
    values = fit.values.copy()
    values[: len(head.values)] = head.values
    return head, CalibratedHead(calibrated_head(replace(fit, values=values), PROVENANCE))


def test_points_without_noise_are_exact(scanned: tuple[SimulatedHead, CalibratedHead]) -> None:
    head, sensor = scanned
    plane = head.plane("scan", 700.0)
    true = np.array([head.point("scan", plane, reading) for reading in READINGS_DEG])
    position, _ = head.seen(true, 0.0, np.random.default_rng(1))
    points = sensor.points(READINGS_DEG, position, np.full_like(position, 0.05))
    np.testing.assert_allclose(points.position_mm, true - [0, 0, head.truth.offset_mm], atol=1e-6)
    np.testing.assert_allclose(points.across_sd, 0.0, atol=1e-6)


def test_noise_of_spot_and_reading_is_as_stated(scanned: tuple[SimulatedHead, CalibratedHead]) -> None:
    head, sensor = scanned
    reading, count = -10.0, 20_000
    true = head.point("scan", head.plane("scan", 700.0), reading)
    position, _ = head.seen(true[None], 0.0, np.random.default_rng(1))
    random = np.random.default_rng(2)
    sd_px = np.array([0.05, 0.08])
    noisy = position + sd_px * random.standard_normal((count, 2))
    readings = reading + sensor.calibration.reading_sd_deg * random.standard_normal(count)
    found = sensor.points(readings, noisy, np.broadcast_to(sd_px, noisy.shape))
    stated = np.median(found.own_covariance_mm2, axis=0)
    simulated = np.cov(found.position_mm.T)
    np.testing.assert_allclose(np.sqrt(np.diag(simulated)), np.sqrt(np.diag(stated)), rtol=0.03)
    correlation = simulated / np.sqrt(np.outer(np.diag(simulated), np.diag(simulated)))
    expected = stated / np.sqrt(np.outer(np.diag(stated), np.diag(stated)))
    np.testing.assert_allclose(correlation, expected, atol=0.03)


def test_noise_is_scaled_as_the_calibration_scaled_it() -> None:
    head = SimulatedHead.of(RIG, 11)
    spots = head.spots((300.0, 900.0), (0.0, 10.0, -10.0, -20.0), 0.05, np.random.default_rng(1))
    fit = fit_head(RIG, spots)
    true = head.point("scan", head.plane("scan", 700.0), -10.0)
    position, _ = head.seen(true[None], 0.0, np.random.default_rng(1))
    plain, scaled = (
        CalibratedHead(calibrated_head(replace(fit, noise_scale=scale), PROVENANCE))
        .points(np.array([-10.0]), position, np.full_like(position, 0.05))
        .own_covariance_mm2
        for scale in (1.0, 3.0)
    )
    np.testing.assert_allclose(scaled, 9 * plain, rtol=1e-9)


def test_uncertainty_of_the_calibration_is_that_of_its_parameters(
    scanned: tuple[SimulatedHead, CalibratedHead],
) -> None:
    """Derivatives by differences, parameter by parameter."""
    head, sensor = scanned
    plane = head.plane("scan", 700.0)
    true = np.array([head.point("scan", plane, reading) for reading in READINGS_DEG])
    position, _ = head.seen(true, 0.0, np.random.default_rng(1))
    sd = np.full_like(position, 0.05)
    base = sensor.points(READINGS_DEG, position, sd)
    values = sensor.values.copy()
    try:
        for n, step in enumerate(np.sqrt(np.diag(sensor.covariance))):
            if step == 0:
                continue
            moved = []
            for sign in (1, -1):
                sensor.values = values.copy()
                sensor.values[n] += sign * 1e-3 * step
                moved.append(sensor.points(READINGS_DEG, position, sd).position_mm)
            slope = (moved[0] - moved[1]) / (2e-3 * step)
            np.testing.assert_allclose(base.common[:, :, n] * step, slope * step, rtol=1e-4, atol=1e-6)
    finally:
        sensor.values = values
    common = base.common @ sensor.covariance @ base.common.transpose(0, 2, 1)
    np.testing.assert_allclose(base.covariance_mm2, base.own_covariance_mm2 + common, rtol=1e-9)


def test_a_spot_beside_the_beam_is_many_deviations_across(
    scanned: tuple[SimulatedHead, CalibratedHead],
) -> None:
    head, sensor = scanned
    true = head.point("scan", head.plane("scan", 700.0), 0.0)
    position, _ = head.seen(true[None], 0.0, np.random.default_rng(1))
    points = sensor.points(np.zeros(1), position + np.array([0.0, 15.0]), np.full((1, 2), 0.05))
    assert abs(points.across_sd[0]) > 10


@pytest.mark.parametrize("depth_mm", [5.0, 39.0, 41.0, 300.0])
def test_a_point_behind_the_reference_plane_is_none(
    scanned: tuple[SimulatedHead, CalibratedHead], depth_mm: float
) -> None:
    """As of a light on the beam nearer than the plane from which ranges count, 40 mm before the pinhole."""
    _, sensor = scanned
    names = sensor.calibration.names
    values = dict(zip(names, sensor.values.tolist(), strict=True)) | {"offset_mm": 40.0}
    own, sensor.values = sensor.values, np.array([values[name] for name in names])
    try:
        ray = turned_ray(
            Ray(*(values[f"S.{name}"] for name in RAY)),
            Head(*(values[f"head.{name}"] for name in HEAD)),
            np.radians(-10.0),
        )
        x_mm, y_mm, tx, ty = (float(np.asarray(part)) for part in ray)
        point = (x_mm + tx * depth_mm, y_mm + ty * depth_mm, depth_mm)
        # Without distortion, so that a spot far outside the image has a position.
        sensor.values[[names.index("k1"), names.index("k2")]] = 0.0
        f_px, cx_px, cy_px = (values[name] for name in ("f_px", "cx_px", "cy_px"))
        position = np.array([[cx_px + f_px * point[0] / point[2], cy_px + f_px * point[1] / point[2]]])
        found = sensor.points(np.array([-10.0]), position, np.full((1, 2), 0.05)).position_mm[0]
    finally:
        sensor.values = own
    if depth_mm < 40.0:
        assert np.isnan(found).all()
    else:
        np.testing.assert_allclose(found, [point[0], point[1], depth_mm - 40.0], atol=1e-6)


def test_a_sight_that_does_not_meet_the_beam_has_no_point(
    scanned: tuple[SimulatedHead, CalibratedHead],
) -> None:
    _, sensor = scanned
    # The laser is on the right: to the left of the vanishing point the lines meet behind the camera.
    points = sensor.points(np.array([20.0]), np.array([[100.0, 240.0]]), np.full((1, 2), 0.05))
    assert np.isnan(points.position_mm).all()
