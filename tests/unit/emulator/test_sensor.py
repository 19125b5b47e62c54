"""Light is conserved, and noise has the statistics that physics gives it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import j1

from tests.support.ideal import F, ideal_rig, laser, moments, painted, scene_of
from workbench.emulator.keyed import generator
from workbench.emulator.sensor import ImageSensor
from workbench.emulator.spec import emulator_spec
from workbench.emulator.speckle import speckle_field
from workbench.emulator.spot import ImageFormat, Spot
from workbench.model.arrays import FloatArray
from workbench.model.rig import Rig
from workbench.model.target import CylinderTarget, FlatTarget, Placement

SMALL = ImageFormat(200, 150)


def sensor_of(rig: Rig, image: ImageFormat = SMALL) -> ImageSensor:
    return ImageSensor(emulator_spec(rig), image, rig.camera.bits)


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


@pytest.mark.parametrize(("bits", "gain"), [(8, 1.0), (12, 1.0), (12, 4.0)])
def test_photon_transfer(bits: int, gain: float) -> None:
    """Variance against mean is a line: slope = numbers per electron, intercept = read noise and rounding."""
    rig = ideal_rig(
        camera={"bits": bits},
        sensor={"read_noise_e": 100.0},
        ambient={"level_e_per_s": 1e6, "gradient_u": 0.0, "gradient_v": 0.0, "flicker_depth": 0.0},
    )
    sensor = sensor_of(rig, ImageFormat(640, 480))
    means, variances = [], []
    for exposure in np.linspace(0.0, 0.03 / gain, 6):
        a, b = (
            sensor.expose((), exposure, gain, 1.0, generator(7, "frame", str(exposure), i)).astype(float)
            for i in (0, 1)
        )
        means.append(a.mean())
        variances.append((a - b).var() / 2)
    slope, intercept = np.polyfit(means, variances, 1)
    per_electron = gain * (2**bits - 1) / 40_000
    black = 0.03 * (2**bits - 1)
    assert slope == pytest.approx(per_electron, rel=0.02)
    assert intercept + slope * black == pytest.approx((100 * per_electron) ** 2 + 1 / 12, rel=0.03)
    assert means[0] == pytest.approx(black, abs=0.02 * 2 ** (bits - 8))


def test_shot_noise_inside_a_spot_is_poissons() -> None:
    rate = np.full((40, 40), 2e5, dtype=np.float32)
    rig = ideal_rig(camera={"bits": 16}, sensor={"read_noise_e": 30.0})
    sensor = sensor_of(rig)
    spots = (Spot(10, 20, rate), Spot(30, 20, rate))  # the second overlaps the first
    frames = np.stack([sensor.expose(spots, 0.01, 1.0, 1.0, generator(3, "f", i)) for i in range(150)])
    electrons = (frames.astype(float) - 0.03 * 65535) * 40_000 / 65535
    for u, level in ((15, 2000.0), (40, 4000.0), (60, 2000.0)):
        block = electrons[:, 22:58, u : u + 8]
        assert block.mean() == pytest.approx(level, rel=2e-3)
        assert block.var(axis=0).mean() == pytest.approx(level + 900, rel=0.03)


def test_numbers_stay_in_their_range() -> None:
    spot = (Spot(0, 0, np.full((150, 200), 1e9, dtype=np.float32)),)
    for bits, kind in ((8, np.uint8), (10, np.uint16), (12, np.uint16), (16, np.uint16)):
        sensor = sensor_of(ideal_rig(camera={"bits": bits}, sensor={"read_noise_e": 5000.0}))
        bright = sensor.expose(spot, 1.0, 1.0, 1.0, generator(1, "a"))
        dark = sensor.expose((), 1.0, 1.0, 1.0, generator(1, "b"))
        assert bright.dtype == kind
        assert bright.min() == 2**bits - 1
        assert dark.min() == 0


def test_hot_pixels_stay_where_they_are() -> None:
    def image(seed: int, frame: int) -> NDArray[np.int64]:
        rig = ideal_rig(seed=seed, sensor={"hot_pixels": 12, "hot_pixel_e_per_s": 1e6})
        shot = sensor_of(rig).expose((), 0.02, 1.0, 1.0, generator(seed, "f", frame))
        return np.flatnonzero(shot > 8)

    assert 8 <= len(image(1, 0)) <= 12
    assert set(image(1, 0)) == set(image(1, 1))
    assert set(image(1, 0)) != set(image(2, 0))


def test_ambient_light_has_the_stated_gradient() -> None:
    ambient = {"level_e_per_s": 1e6, "gradient_u": 0.4, "gradient_v": -0.2}
    shot = sensor_of(ideal_rig(camera={"bits": 16}, ambient=ambient)).expose(
        (), 0.02, 1.0, 1.0, generator(1, "f")
    )
    electrons = (shot.astype(float) - 0.03 * 65535) * 40_000 / 65535
    level = electrons.mean()
    assert level == pytest.approx(2e4, rel=1e-3)
    assert (electrons[:, -1].mean() - electrons[:, 0].mean()) / level == pytest.approx(0.4, abs=0.01)
    assert (electrons[-1].mean() - electrons[0].mean()) / level == pytest.approx(-0.2, abs=0.01)


def test_clutter_stands_still_and_has_edges() -> None:
    def room(seed: int, clutter: float, frame: int = 0) -> FloatArray:
        ambient = {"level_e_per_s": 1e6, "gradient_u": 0.0, "gradient_v": 0.0, "clutter": clutter}
        rig = ideal_rig(seed=seed, camera={"bits": 16}, ambient=ambient)
        return sensor_of(rig).expose((), 0.01, 1.0, 1.0, generator(seed, "f", frame)).astype(float)

    even, cluttered = room(1, 0.0), room(1, 0.5)
    assert cluttered.std() > 5 * even.std()
    assert np.abs(np.diff(cluttered, axis=1)).max() > 0.1 * cluttered.mean()
    assert np.corrcoef(cluttered.ravel(), room(1, 0.5, frame=1).ravel())[0, 1] > 0.9
    assert np.corrcoef(cluttered.ravel(), room(2, 0.5).ravel())[0, 1] < 0.7


@pytest.mark.parametrize("grain", [0.1733, 0.5, 2.0])
def test_speckle_has_the_correlation_of_a_round_pupil(grain: float) -> None:
    """Mean 1, contrast 1, covariance (2 J1(x) / x)^2 with x = pi r / (lambda N)."""
    step = grain / 4
    fields = [speckle_field((256, 256), step, grain, 1.0, generator(5, "s", i)) for i in range(12)]
    assert np.mean(fields) == pytest.approx(1.0, abs=0.01)
    assert np.std(fields) == pytest.approx(1.0, abs=0.03)
    spectra = [np.abs(np.fft.fft2(field - 1)) ** 2 for field in fields]
    covariance = np.fft.ifft2(np.mean(spectra, axis=0)).real / 256**2
    for lag in (1, 2, 4, 5):
        x = np.pi * lag * step / grain
        assert covariance[0, lag] == pytest.approx((2 * j1(x) / x) ** 2, abs=0.02)


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


def test_speckle_stands_still_until_the_target_moves(tmp_path: Path) -> None:
    scene = scene_of(ideal_rig(beam={"speckle_contrast": 1.0}), tmp_path)
    patterns = []
    for key in ("A", "B", "A"):
        scene.place(Placement(key=key, standoff_mm=500.0))
        patterns.append(scene.spots("L1")[0].rate)
    assert np.array_equal(patterns[0], patterns[2])
    assert not np.array_equal(patterns[0], patterns[1])
