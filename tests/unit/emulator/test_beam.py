"""A Gaussian beam against its closed form."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.emulator.beam import Beam
from workbench.emulator.spec import BeamSpec
from workbench.emulator.truth import TrueRay

RAY = TrueRay(60.0, -5.0, 0.02, -0.01)
SPEC = BeamSpec(power_mw=2.0, exit_diameter_mm=1.5, divergence_mrad=1.6)
ALONG = np.array([0.02, -0.01, 1.0])
AXIS = ALONG / np.linalg.norm(ALONG)
ACROSS = np.cross(AXIS, [0.0, 1.0, 0.0]) / np.linalg.norm(np.cross(AXIS, [0.0, 1.0, 0.0]))


def at(path_mm: float, aside_mm: float = 0.0) -> np.ndarray:
    """(1, 3) point beside the axis."""
    return np.asarray(np.array([60.0, -5.0, 0.0]) + path_mm * AXIS + aside_mm * ACROSS)[None]


def radius(path_mm: float) -> float:
    """1/e^2."""
    return (1.5 + 1.6e-3 * path_mm) / 2


@pytest.mark.parametrize("path_mm", [1.0, 500.0, 5000.0])
def test_the_axis_has_twice_the_mean_irradiance_and_one_radius_aside_has_its_e_2nd_part(
    path_mm: float,
) -> None:
    beam, facing = Beam(RAY, SPEC), -AXIS[None]
    peak = 2 * 2e-3 / (np.pi * radius(path_mm) ** 2)
    assert beam.irradiance(at(path_mm), facing)[0] == pytest.approx(peak)
    assert beam.irradiance(at(path_mm, radius(path_mm)), facing)[0] == pytest.approx(peak * np.exp(-2))


def test_a_cross_section_takes_the_whole_power() -> None:
    beam, path_mm = Beam(RAY, SPEC), 900.0
    step = 0.02
    grid = np.arange(-4.0, 4.0, step)
    other = np.cross(AXIS, ACROSS)
    points = at(path_mm)[0] + (grid[:, None, None] * ACROSS + grid[None, :, None] * other)
    points = points.reshape(-1, 3)
    irradiance = beam.irradiance(points, np.broadcast_to(-AXIS, points.shape))
    assert irradiance.sum() * step**2 == pytest.approx(2e-3, rel=1e-6)


@pytest.mark.parametrize(("turn_deg", "share"), [(0.0, 1.0), (60.0, 0.5), (90.0, 0.0), (150.0, 0.0)])
def test_a_turned_surface_takes_the_cosine_and_one_that_looks_away_none(
    turn_deg: float, share: float
) -> None:
    beam, turn = Beam(RAY, SPEC), np.radians(turn_deg)
    normal = -np.cos(turn) * AXIS + np.sin(turn) * ACROSS
    faced = beam.irradiance(at(500.0), -AXIS[None])[0]
    assert beam.irradiance(at(500.0), normal[None])[0] == pytest.approx(share * faced, abs=1e-12)


def test_nothing_behind_the_laser_is_lit() -> None:
    assert Beam(RAY, SPEC).irradiance(at(-100.0), -AXIS[None])[0] == 0.0


@pytest.mark.parametrize("radii", [1.0, 3.0])
def test_the_outline_is_the_cone_at_so_many_radii(radii: float) -> None:
    """The ray's own third component is 1: its circle lies across the camera's axis."""
    origins, directions = Beam(RAY, SPEC).outline(radii, 16)
    assert origins.shape == directions.shape == (16, 3)
    for z_mm in (0.0, 800.0):
        points = origins + z_mm * directions
        centre = np.array([60.0, -5.0, 0.0]) + z_mm * ALONG
        away = points - centre
        np.testing.assert_allclose(np.hypot(away[:, 0], away[:, 1]), radii * radius(z_mm))
        np.testing.assert_array_equal(points[:, 2], z_mm)
        np.testing.assert_allclose(away.mean(axis=0), 0.0, atol=1e-12)
