"""Spots lie where a pencil and paper put them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

from tests.support.ideal import CX, CY, F, exact, ideal_rig, laser, moments, painted, scene_of
from workbench.emulator.lens import Lens
from workbench.emulator.spec import emulator_spec
from workbench.emulator.surfaces import Cylinder, Plane, Polynomial, Surface
from workbench.emulator.truth import Truth, draw_truth
from workbench.model.errors import BadInputError
from workbench.model.target import CylinderTarget, FlatTarget, NoTarget, Placement, PolynomialTarget


@pytest.mark.parametrize("z_mm", [300.0, 1000.0, 5000.0])
@pytest.mark.parametrize("ray", [(60.0, 0.0, 0.0, 0.0), (-30.0, 0.2, 0.004, -0.006), (0.0, 40.0, 0.01, 0.0)])
def test_spot_lies_at_the_projection_of_the_ray(
    tmp_path: Path, z_mm: float, ray: tuple[float, float, float, float]
) -> None:
    x, y, tx, ty = ray
    # Without blur, a far spot is narrower than a pixel and its centroid is not its centre.
    rig = ideal_rig(laser("L", x, y, tx, ty), lens={"blur_px": 0.7})
    centre, _ = moments(painted(rig, tmp_path, z_mm))
    expected = [CX + F * (x + tx * z_mm) / z_mm, CY + F * (y + ty * z_mm) / z_mm]
    # Across a spot of finite size the light falls off with the field angle: 4 x sigma^2 / z^2 of shift.
    assert centre == pytest.approx(expected, abs=3e-3)


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


FISHEYE = {"lens": "equidistant", "f_px": {"value": 305.6, "sd": 0.0}}
LENSES = {
    "plumb_bob": Truth(F, CX, CY, -0.25, 0.1, 0.002, 0.001, 0.0, 0.0, 0.0, {}),
    "equidistant": Truth(305.6, CX, CY, 0.04, -0.02, 0.0, 0.0, 0.01, 0.0, 0.0, {}, "equidistant", -0.003),
}


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


def test_a_pin_of_another_lens_is_refused() -> None:
    with pytest.raises(BadInputError, match=r"emulator\.truth: p1"):
        emulator_spec(ideal_rig(camera=FISHEYE, truth={"p1": 0.001}))
    assert emulator_spec(ideal_rig(camera=FISHEYE, truth={"k4": 0.001})).truth.k4 == 0.001


def test_a_fisheye_that_does_not_reach_the_corner_is_refused() -> None:
    rig = ideal_rig(camera=FISHEYE, truth={"k1": -0.4})
    with pytest.raises(BadInputError, match="k1, k2, k3, k4"):
        draw_truth(rig, emulator_spec(rig))


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


def test_a_lens_that_folds_is_refused() -> None:
    rig = ideal_rig(truth={"k1": -2.0})
    with pytest.raises(BadInputError, match="climbs to the image corner"):
        draw_truth(rig, emulator_spec(rig))


@pytest.mark.parametrize(("yaw", "x"), [(45.0, 60.0), (-30.0, 60.0), (60.0, 30.0)])
def test_spot_on_a_tilted_plane_is_an_ellipse(tmp_path: Path, yaw: float, x: float) -> None:
    z0 = 300.0
    spot = painted(ideal_rig(laser("L", x)), tmp_path, z0, FlatTarget(yaw_deg=yaw))
    centre, variance = moments(spot)
    z = z0 + x * np.tan(np.radians(yaw))
    sigma_mm = (1.5 + 1.6e-3 * z) / 4  # 1/e^2 diameter is four standard deviations
    assert centre[0] == pytest.approx(CX + F * x / z, abs=0.02)
    # u = f x / (z0 + x tan yaw), so du/dx = f z0 / z^2 across the beam, and dv/dy = f / z; a pixel adds 1/12.
    assert np.sqrt(variance - 1 / 12) == pytest.approx([sigma_mm * F * z0 / z**2, sigma_mm * F / z], rel=0.01)


def test_pitch_moves_what_is_below_away(tmp_path: Path) -> None:
    rig = ideal_rig(laser("L", 0.0, 50.0))
    centre, _ = moments(painted(rig, tmp_path, 400.0, FlatTarget(pitch_deg=20.0)))
    z = 400 + 50 * np.tan(np.radians(20))
    assert centre == pytest.approx([CX, CY + F * 50 / z], abs=0.01)


def test_blur_adds_its_variance(tmp_path: Path) -> None:
    _, sharp = moments(painted(ideal_rig(), tmp_path, 300.0))
    _, soft = moments(painted(ideal_rig(lens={"blur_px": 0.8}), tmp_path, 300.0))
    assert soft - sharp == pytest.approx([0.64, 0.64], rel=2e-3)


@pytest.mark.parametrize(("z_mm", "within_px"), [(5000.0, 3e-3), (550.0, 5e-4)])
def test_pixels_integrate_small_spots(tmp_path: Path, z_mm: float, within_px: float) -> None:
    """Without blur sigma is 0.25 px at 5 m, 0.58 px at 0.55 m; the integral over a pixel is an erf."""
    sigma = (1.5 + 1.6e-3 * z_mm) / 4 * F / z_mm
    edges = np.arange(-6, 7) - 0.5
    for offset in np.arange(6) / 6:
        rig = ideal_rig(laser("L", 60.0, tx=offset / F))
        centre, variance = moments(painted(rig, tmp_path, z_mm))
        whole, place = divmod(CX + F * 60 / z_mm + offset, 1)
        shares = np.diff(norm.cdf((edges - place) / sigma))
        mean = float(shares @ (edges[:-1] + 0.5))
        assert centre[0] - whole == pytest.approx(mean, abs=within_px)
        spread = float(shares @ (edges[:-1] + 0.5 - mean) ** 2)
        assert variance[0] == pytest.approx(spread, abs=within_px, rel=5e-3)


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
    surface = Polynomial(500.0, coefficients, shift, 0.8)
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
    surface = Polynomial(300.0, (-16.4, 0.403, -0.003186, 0.0000073), 60.0, 0.8)
    slopes = np.linspace(0.17, 0.23, 5000)  # a window of 32 px
    direction = np.column_stack([slopes, np.full(5000, 0.1), np.ones(5000)])
    many = surface.depth(np.zeros(3), direction)
    each = surface.depth(np.zeros((5000, 3)), direction)
    same = np.abs(many - each) < 1e-3
    assert same.mean() > 0.998  # all but the rays at the step where one flank hides another


@pytest.mark.parametrize(
    "surface",
    [
        Plane(400.0, 0.6, -0.3, 0.8),
        Cylinder(20.0, 450.0, 89.0, 0.8),
        Polynomial(400.0, (0.3, 0.004), -10.0, 0.8),
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


def test_nothing_is_seen_of_what_is_not_there(tmp_path: Path) -> None:
    scene = scene_of(ideal_rig(laser("L", 60.0)), tmp_path)
    cases: list[tuple[float, Any]] = [
        (500.0, NoTarget()),
        (60.0, FlatTarget()),  # the spot leaves the field of view
        (500.0, FlatTarget(width_mm=80.0)),
        (500.0, FlatTarget(height_mm=20.0, width_mm=40.0, shift_mm=-60.0)),
        (500.0, CylinderTarget(diameter_mm=100.0)),
    ]
    assert scene.spots("L") == []
    for standoff, target in cases:
        scene.place(Placement(key="P", standoff_mm=standoff, target=target))
        assert scene.spots("L") == []


def test_small_target_shows_the_beams_that_meet_it(tmp_path: Path) -> None:
    scene = scene_of(ideal_rig(laser("A", 60.0), laser("B", 30.0)), tmp_path)
    scene.place(Placement(key="P", standoff_mm=500.0, target=FlatTarget(width_mm=40.0, shift_mm=60.0)))
    assert [len(scene.spots(name)) for name in ("A", "B")] == [1, 0]


@pytest.mark.parametrize("yaw", [0.0, 5.0, -8.0])
def test_mirror_shows_the_wall_where_the_light_comes_from(tmp_path: Path, yaw: float) -> None:
    scene = scene_of(
        ideal_rig(laser("L", 60.0), surface={"wall_behind_mm": 1000.0}, lens={"blur_px": 0.7}), tmp_path
    )
    scene.place(Placement(key="P", standoff_mm=600.0, target=FlatTarget(finish="mirror", yaw_deg=yaw)))
    face, ghost = (moments(spot)[0][0] for spot in scene.spots("L"))
    tangent = np.tan(np.radians(yaw))
    hit_z = 600 + 60 * tangent
    assert face == pytest.approx(CX + F * 60 / hit_z, abs=0.01)
    # Law of reflection: the beam (0, 1) leaves as (sin 2 yaw, -cos 2 yaw) and meets the wall z = -1000 there;
    # the camera sees that point's mirror image, at its perpendicular distance behind the mirror.
    turn = 2 * np.radians(yaw)
    path = (hit_z + 1000) / np.cos(turn)
    wall = np.array([60 + path * np.sin(turn), -1000.0])
    normal = np.array([-np.sin(turn / 2), np.cos(turn / 2)])
    image = wall - 2 * ((wall - [0, 600.0]) @ normal) * normal
    assert ghost == pytest.approx(CX + F * image[0] / image[1], abs=0.01)


def test_a_mirror_turned_far_shows_no_second_spot(tmp_path: Path) -> None:
    scene = scene_of(ideal_rig(laser("L", 60.0)), tmp_path)
    scene.place(Placement(key="P", standoff_mm=600.0, target=FlatTarget(finish="mirror", yaw_deg=50.0)))
    assert len(scene.spots("L")) == 1


def test_the_standoff_is_by_the_ruler(tmp_path: Path) -> None:
    truth = {"offset_mm": 12.0, "ruler_scale": 0.001, "placements": {"P": {"error_mm": 0.4}}}
    centre, _ = moments(painted(ideal_rig(truth=truth), tmp_path, 500.0))
    assert centre[0] == pytest.approx(CX + F * 60 / (500.5 + 0.4 + 12), abs=3e-3)


def test_tilt_of_the_placement_adds_to_the_targets(tmp_path: Path) -> None:
    rig = ideal_rig(truth={"placements": {"P": {"yaw_deg": 10.0, "pitch_deg": 0.0}}})
    centre, _ = moments(painted(rig, tmp_path, 500.0, FlatTarget(yaw_deg=20.0)))
    assert centre[0] == pytest.approx(CX + F * 60 / (500 + 60 * np.tan(np.radians(30))), abs=0.01)


def test_a_plane_on_edge_is_refused(tmp_path: Path) -> None:
    scene = scene_of(ideal_rig(), tmp_path)
    with pytest.raises(BadInputError, match="less than 90 deg"):
        scene.place(Placement(key="P", standoff_mm=500.0, target=FlatTarget(yaw_deg=90.0)))


def test_the_principal_point_and_f_are_the_truths(tmp_path: Path) -> None:
    rig = ideal_rig(camera={"f_px": exact(600.0)}, truth={"cx_px": 350.0, "cy_px": 220.0})
    centre, _ = moments(painted(rig, tmp_path, 1000.0))
    assert centre == pytest.approx([350 + 36, 220], abs=2e-3)
