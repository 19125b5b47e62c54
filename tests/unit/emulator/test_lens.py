"""The lens: forward against formulas, backward against forward."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.support.ideal import CX, CY, FISHEYE, F, ideal_rig, laser, moments, painted
from tests.support.rigs import opencv_pixels
from workbench.emulator.lens import Drift, Lens
from workbench.emulator.spec import emulator_spec
from workbench.emulator.truth import Truth, draw_truth
from workbench.model.errors import BadInputError

LENSES = {
    "plumb_bob": Truth(F, CX, CY, -0.25, 0.1, 0.002, 0.001, 0.0, 0.0, 0.0, {}),
    "equidistant": Truth(305.6, CX, CY, 0.04, -0.02, 0.0, 0.0, 0.01, 0.0, 0.0, {}, "equidistant", -0.003),
}


def test_distortion_is_brown_conradys(tmp_path: Path) -> None:
    lens = {"k1": -0.25, "k2": 0.12, "p1": 0.003, "p2": -0.002, "k3": -0.02}
    rig = ideal_rig(laser("L", 150.0, 80.0), truth=lens)
    centre, _ = moments(painted(rig, tmp_path, 400.0))
    x, y = 150 / 400, 80 / 400
    r2 = x * x + y * y
    radial = 1 - 0.25 * r2 + 0.12 * r2**2 - 0.02 * r2**3
    u = x * radial + 2 * 0.003 * x * y - 0.002 * (r2 + 2 * x * x)
    v = y * radial + 0.003 * (r2 + 2 * y * y) - 2 * 0.002 * x * y
    assert centre == pytest.approx([CX + F * u, CY + F * v], abs=5e-3)


@pytest.mark.parametrize("seed", range(8))
def test_every_pixel_of_a_drawn_lens_has_its_line_of_sight(seed: int) -> None:
    camera = {"k1": {"value": 0.0, "sd": 0.3}, "k2": {"value": 0.0, "sd": 0.3}}
    rig = ideal_rig(camera=camera, seed=seed)
    lens = Lens(draw_truth(rig, emulator_spec(rig)))
    u, v = (a.ravel().astype(float) for a in np.meshgrid(np.arange(0, 640, 71), np.arange(0, 480, 53)))
    sight = lens.back_project(u, v)
    back = lens.project(np.column_stack([sight.x, sight.y, np.ones(len(u))]))
    assert back == pytest.approx(np.column_stack([u, v]), abs=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_every_pixel_of_a_drawn_fisheye_has_its_line_of_sight(seed: int) -> None:
    """To the corners, 75 degrees off the axis."""
    sd = {"k1": 0.05, "k2": 0.02, "k3": 0.01, "k4": 0.005}
    rig = ideal_rig(camera=FISHEYE | {k: {"value": 0.0, "sd": s} for k, s in sd.items()}, seed=seed)
    truth = draw_truth(rig, emulator_spec(rig))
    assert truth.lens == "equidistant"
    assert all(getattr(truth, name) != 0 for name in sd)
    assert truth.p1 == truth.p2 == 0
    u, v = (a.ravel().astype(float) for a in np.meshgrid(np.linspace(0, 639, 10), np.linspace(0, 479, 10)))
    sight = Lens(truth).back_project(u, v)
    back = Lens(truth).project(np.column_stack([sight.x, sight.y, np.ones(len(u))]))
    assert back == pytest.approx(np.column_stack([u, v]), abs=1e-6)
    # By hand: the angle's polynomial is the distance from the centre, in focal lengths.
    angle = np.arctan(np.hypot(sight.x, sight.y))
    radius = angle * (1 + sum(getattr(truth, name) * angle ** (2 * n + 2) for n, name in enumerate(sd)))
    assert radius * 305.6 == pytest.approx(np.hypot(u - CX, v - CY), abs=1e-6)


@pytest.mark.parametrize("name", LENSES)
def test_area_of_a_pixel_is_the_area_between_its_corners(name: str) -> None:
    lens = Lens(LENSES[name])
    corners = lens.back_project(
        np.array([599.5, 600.5, 600.5, 599.5]), np.array([419.5, 419.5, 420.5, 420.5])
    )
    x, y = corners.x, corners.y
    shoelace = abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2
    middle = lens.back_project(np.array([600.0]), np.array([420.0]))
    assert middle.area[0] == pytest.approx(shoelace, rel=1e-4)


@pytest.mark.parametrize("name", LENSES)
def test_splines_between_pixels_agree_with_newton(name: str) -> None:
    lens = Lens(LENSES[name])
    whole_u, whole_v = np.arange(560.0, 580.0), np.arange(400.0, 421.0)
    u, v = np.linspace(562, 577, 40), np.linspace(402, 418, 30)
    fine = lens.back_project_grid(whole_u, whole_v, u, v)
    uu, vv = np.meshgrid(u, v)
    exact_sight = lens.back_project(uu.ravel(), vv.ravel())
    assert np.abs(fine.x.ravel() - exact_sight.x).max() * F < 1e-7
    assert fine.area.ravel() == pytest.approx(exact_sight.area, rel=1e-7)


@pytest.mark.parametrize("name", LENSES)
def test_points_are_where_opencv_has_them(name: str) -> None:
    truth = LENSES[name]
    coefficients = {"plumb_bob": ("k1", "k2", "p1", "p2", "k3"), "equidistant": ("k1", "k2", "k3", "k4")}
    values = [truth.f_px, truth.cx_px, truth.cy_px, *(getattr(truth, k) for k in coefficients[name])]
    points = np.array([[60.0, -30.0, 200.0], [-100.0, 80.0, 400.0], [0.0, 0.0, 50.0]])
    np.testing.assert_allclose(Lens(truth).project(points), opencv_pixels(truth.lens, values, points))


def test_a_focal_length_that_drifted_scales_the_picture_about_its_centre() -> None:
    pinhole = Truth(F, CX, CY, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, {})
    points = np.array([[60.0, -30.0, 200.0], [-100.0, 80.0, 400.0]])
    drifted, centred = Lens(pinhole, Drift(1.01)).project(points), Lens(pinhole).project(points)
    np.testing.assert_allclose(drifted - [CX, CY], 1.01 * (centred - [CX, CY]))


def test_a_pixel_that_no_line_of_sight_leads_to_is_refused() -> None:
    folding = Truth(F, CX, CY, -0.45, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, {})
    # r (1 - 0.45 r^2) grows up to 0.574 focal lengths.
    inside, outside = CX + 0.55 * F, CX + 0.6 * F
    assert Lens(folding).back_project(np.array([inside]), np.array([CY])).x[0] > 0.55
    with pytest.raises(BadInputError):
        Lens(folding).back_project(np.array([outside]), np.array([CY]))
