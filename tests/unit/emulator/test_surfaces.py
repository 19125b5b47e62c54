"""Surfaces: where lines of sight meet them, and which way they face."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.support.ideal import CX, F, ideal_rig, laser, moments, painted, scene_of
from workbench.emulator.surfaces import CylinderSurface, PlaneSurface, PolynomialSurface, Surface
from workbench.model.target import CylinderTarget, Placement, PolynomialTarget


@pytest.mark.parametrize("x", [-60.0, -30.0, 30.0, 60.0])
def test_cylinder_of_the_thesis(tmp_path: Path, x: float) -> None:
    target = CylinderTarget(diameter_mm=178.0)
    centre, _ = moments(painted(ideal_rig(laser("L", x)), tmp_path, 400.0, target))
    z = 400 + 89 - np.sqrt(89**2 - x**2)
    assert centre[0] == pytest.approx(CX + F * x / z, abs=0.02)


THESIS_PROFILES: list[tuple[tuple[float, ...], float]] = [
    ((0.0, 0.02), 0.0),
    ((0.0, 0.02), 60.0),
    ((0.0, 0.0, 0.0003), 0.0),
    ((0.0, 0.0, 0.0003), 60.0),
    ((-16.4, 0.403, -0.003186, 0.0000073), 60.0),
    ((1.7320508,), 0.0),
]


@pytest.mark.parametrize(("coefficients", "shift"), THESIS_PROFILES)
def test_polynomials_of_the_thesis(tmp_path: Path, coefficients: tuple[float, ...], shift: float) -> None:
    target = PolynomialTarget(coefficients=coefficients, shift_mm=shift)
    for x in (-30.0, 30.0, 60.0):
        z = 900 + sum(c * (x - shift) ** (k + 1) for k, c in enumerate(coefficients))
        slope = sum((k + 1) * c * (x - shift) ** k for k, c in enumerate(coefficients))
        if abs(slope) > 5:
            continue  # the beam is smeared along a cliff
        scene = scene_of(ideal_rig(laser("L", x), beam={"exit_diameter_mm": 0.5}), tmp_path)
        scene.place(Placement(key="P", standoff_mm=900.0, target=target))
        for spot in scene.spots("L"):
            centre, _ = moments(spot)
            assert centre[0] == pytest.approx(CX + F * x / z, abs=0.1)


@pytest.mark.parametrize(("coefficients", "shift"), THESIS_PROFILES)
def test_first_crossing_is_the_first(coefficients: tuple[float, ...], shift: float) -> None:
    surface = PolynomialSurface(500.0, coefficients, shift, 0.8)
    slopes = np.linspace(-0.5, 0.5, 11)
    direction = np.column_stack([slopes, np.zeros(11), np.ones(11)])
    depth = surface.depth(np.zeros(3), direction)
    along = np.arange(0.5, 3000.0, 0.5)
    for slope, found in zip(slopes, depth, strict=True):
        gap = 500 - along
        for power, c in enumerate(coefficients):
            gap = gap + c * (slope * along - shift) ** (power + 1)
        crossings = np.flatnonzero(np.sign(gap[1:]) != np.sign(gap[:-1]))
        if len(crossings):
            assert along[crossings[0]] - 1e-6 <= found <= along[crossings[0] + 1] + 1e-6
        else:
            assert np.isnan(found) or found > 2999


def test_many_rays_of_one_origin_meet_where_each_does() -> None:
    surface = PolynomialSurface(300.0, (-16.4, 0.403, -0.003186, 0.0000073), 60.0, 0.8)
    slopes = np.linspace(0.17, 0.23, 5000)  # a window of 32 px
    direction = np.column_stack([slopes, np.full(5000, 0.1), np.ones(5000)])
    many = surface.depth(np.zeros(3), direction)
    each = surface.depth(np.zeros((5000, 3)), direction)
    same = np.abs(many - each) < 1e-3
    assert same.mean() > 0.998  # all but the rays at the step where one flank hides another


@pytest.mark.parametrize(
    "surface",
    [
        PlaneSurface(400.0, 0.6, -0.3, 0.8),
        CylinderSurface(20.0, 450.0, 89.0, 0.8),
        PolynomialSurface(400.0, (0.3, 0.004), -10.0, 0.8),
    ],
)
def test_normals_stand_on_their_surface(surface: Surface) -> None:
    rng = np.random.default_rng(3)
    direction = np.column_stack([rng.uniform(-0.1, 0.15, (50, 2)), np.ones(50)])
    points = surface.depth(np.zeros(3), direction)[:, None] * direction
    beside = direction + rng.normal(0, 1e-6, direction.shape) * np.array([1, 1, 0])
    chords = surface.depth(np.zeros(3), beside)[:, None] * beside - points
    normals = surface.normal(points)
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0)
    assert np.einsum("ij,ij->i", normals, direction).max() < 0
    angles = np.einsum("ij,ij->i", chords, normals) / np.linalg.norm(chords, axis=1)
    assert np.abs(angles).max() < 1e-4
