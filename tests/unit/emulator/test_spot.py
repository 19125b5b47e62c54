"""Images of single beams: place, size, and light collected, by pencil and paper."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import norm

from tests.support.ideal import CX, CY, F, ideal_rig, laser, moments, painted, scene_of
from workbench.emulator.beam import Beam
from workbench.emulator.lens import Lens
from workbench.emulator.spec import emulator_spec
from workbench.emulator.spot import ImageFormat, SpotPainter
from workbench.emulator.surfaces import PlaneSurface
from workbench.emulator.truth import draw_truth
from workbench.model.target import CylinderTarget, FlatTarget, Placement


def test_pixels_collect_what_the_pupil_lets_in(tmp_path: Path) -> None:
    """1 mW on paper of albedo 0.8, f/2, 7.5 um pixels, 650 nm; worked out from the textbook, not the code."""
    pupil_mm2 = np.pi / 4 * (F * 7.5e-3 / 2) ** 2
    electrons_per_mj = 0.6 * 0.3 * 1e-3 * 650e-9 / (6.62607015e-34 * 299792458)
    for z, yaw, x in [(130.0, 0, 30), (500, 0, 60), (500, 50, 60), (500, -50, 60), (5000, 0, 60)]:
        rig = ideal_rig(laser("L", float(x)))
        spot = painted(rig, tmp_path, float(z), FlatTarget(yaw_deg=float(yaw)))
        hit = np.array([x, 0, z + x * np.tan(np.radians(yaw))])
        r = np.linalg.norm(hit)
        normal = np.array([np.sin(np.radians(yaw)), 0, -np.cos(np.radians(yaw))])
        cos_alpha, cos_theta = hit[2] / r, -normal @ hit / r
        expected = electrons_per_mj * 0.8 / np.pi * pupil_mm2 * cos_alpha * cos_theta / r**2
        assert float(spot.rate.sum()) == pytest.approx(expected, rel=3e-3)


def test_edge_of_a_cylinder_takes_its_share_of_the_beam(tmp_path: Path) -> None:
    whole = painted(ideal_rig(laser("L", 60.0)), tmp_path, 1000.0)
    wide = CylinderTarget(diameter_mm=120.0)  # the beam's axis grazes it: half the beam passes by
    half = painted(ideal_rig(laser("L", 60.0)), tmp_path, 1000.0, wide)
    # z of the edge is a radius behind the nearest point; seen from the camera the surface is nearly on edge.
    assert 0 < half.rate.sum() < 0.1 * whole.rate.sum()


def test_absorbent_target_returns_its_albedo(tmp_path: Path) -> None:
    paper = painted(ideal_rig(), tmp_path, 500.0).rate.sum()
    velvet = painted(ideal_rig(), tmp_path, 500.0, FlatTarget(finish="absorbent")).rate.sum()
    assert velvet / paper == pytest.approx(0.01 / 0.8, rel=1e-4)


def test_pixels_average_speckle(tmp_path: Path) -> None:
    """A wide, even spot: contrast = sqrt(grain area / pixel area) while a pixel holds many grains."""
    rig = ideal_rig(beam={"speckle_contrast": 1.0, "exit_diameter_mm": 60.0, "divergence_mrad": 0.0})
    even = ideal_rig(beam={"exit_diameter_mm": 60.0, "divergence_mrad": 0.0})
    grainy, smooth = (painted(r, tmp_path, 400.0).rate for r in (rig, even))
    middle = smooth > 0.5 * smooth.max()
    ratio = grainy[middle] / smooth[middle]
    grain = 0.65 * 2 / 7.5
    assert ratio.mean() == pytest.approx(1.0, abs=0.01)
    # At 5.8 grains a side the covariance's tail is cut by the pixel: a few per cent less than the limit.
    assert ratio.std() == pytest.approx(np.sqrt(4 / np.pi) * grain, rel=0.08)


@pytest.mark.parametrize("standoff", [400.0, 4000.0])
def test_speckle_moves_the_centroid_alike_at_every_range(tmp_path: Path, standoff: float) -> None:
    """sqrt(grain area / (8 pi)) = lambda N / (sqrt(2) pi) in any Gaussian spot wider than a grain: 0.039."""
    rig = ideal_rig(beam={"speckle_contrast": 1.0}, lens={"blur_px": 0.7})
    scene = scene_of(rig, tmp_path)
    places = []
    for i in range(150):
        scene.place(Placement(key=f"P{i}", standoff_mm=standoff))
        places.append(moments(scene.spots("L1")[0])[0])
    scatter = np.std(places, axis=0)
    assert scatter == pytest.approx([0.65 * 2 / 7.5 / np.sqrt(2) / np.pi] * 2, rel=0.2)


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


def test_what_misses_the_surface_or_the_picture_is_no_spot(tmp_path: Path) -> None:
    rig = ideal_rig(laser("L", 60.0))
    spec = emulator_spec(rig)
    truth = draw_truth(rig, spec)
    painter = SpotPainter(spec, Lens(truth), ImageFormat(640, 480), truth.f_px)
    beam = Beam(truth.lasers["L"], spec.beam)
    wall = PlaneSurface(500.0, 0.0, 0.0, 0.8)
    assert painter.paint(beam, wall, 1.0, ("P", "L")) is not None
    assert painter.paint(beam, PlaneSurface(60.0, 0.0, 0.0, 0.8), 1.0, ("P", "L")) is None
    narrow = PlaneSurface(500.0, 0.0, 0.0, 0.8, half_width_mm=20.0)
    assert painter.paint(beam, narrow, 1.0, ("P", "L")) is None
    half, whole = (painter.paint(beam, wall, gain, ("P", "L")) for gain in (0.5, 1.0))
    assert half is not None
    assert whole is not None
    np.testing.assert_allclose(half.rate, whole.rate / 2, rtol=1e-6)


@pytest.mark.parametrize(("x_mm", "cut"), [(60.0, False), (63.8, True)])
def test_the_window_of_a_spot_ends_at_the_picture_s_edge(tmp_path: Path, x_mm: float, cut: bool) -> None:
    """63.8 mm at 106.3 mm is at u = 639.6 px, of 639.5."""
    spot = painted(ideal_rig(laser("L", x_mm)), tmp_path, 106.3)
    right = spot.left + spot.rate.shape[1]
    assert right <= 640
    assert (right == 640) == cut
    assert (spot.rate[:, -1].max() > 0.1 * spot.rate.max()) == cut
