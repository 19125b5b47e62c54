"""Noise, hot pixels and ambient light of the sensor have the statistics that physics gives them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.support.ideal import ideal_rig
from workbench.emulator.keyed import generator
from workbench.emulator.sensor import ImageSensor
from workbench.emulator.spec import emulator_spec
from workbench.emulator.spot import ImageFormat, SpotImage
from workbench.model.arrays import FloatArray
from workbench.model.rig import Rig

SMALL = ImageFormat(200, 150)


def sensor_of(rig: Rig, image: ImageFormat = SMALL) -> ImageSensor:
    return ImageSensor(emulator_spec(rig), image, rig.camera.bits)


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
    spots = (SpotImage(10, 20, rate), SpotImage(30, 20, rate))  # the second overlaps the first
    frames = np.stack([sensor.expose(spots, 0.01, 1.0, 1.0, generator(3, "f", i)) for i in range(150)])
    electrons = (frames.astype(float) - 0.03 * 65535) * 40_000 / 65535
    for u, level in ((15, 2000.0), (40, 4000.0), (60, 2000.0)):
        block = electrons[:, 22:58, u : u + 8]
        assert block.mean() == pytest.approx(level, rel=2e-3)
        assert block.var(axis=0).mean() == pytest.approx(level + 900, rel=0.03)


def test_numbers_stay_in_their_range() -> None:
    spot = (SpotImage(0, 0, np.full((150, 200), 1e9, dtype=np.float32)),)
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


@pytest.mark.parametrize("up", [0.0, 0.5, 1.0])
def test_charge_beyond_the_full_well_spills_along_its_column(up: float) -> None:
    quiet = {"read_noise_e": 0.0, "hot_pixels": 0, "black_level": 0.0, "full_well_e": 1000.0}
    rig = ideal_rig(camera={"bits": 16}, sensor={**quiet, "blooming": 1.0, "blooming_up": up})
    light = np.zeros((1, 3), np.float32)
    light[0, 1] = 20_000.0
    frame = sensor_of(rig).expose([SpotImage(top=75, left=99, rate=light)], 1.0, 1.0, 0.0, generator(3, "f"))
    column = frame[:, 100] * (1000.0 / 65535)
    assert column.sum() == pytest.approx(20_000, rel=0.03)  # Poisson noise of the light: 0.7 %
    assert np.delete(frame, 100, axis=1).max() == 0
    above, below = column[:75].sum(), column[76:].sum()
    assert above / (above + below) == pytest.approx(up, abs=0.01)
    full = np.flatnonzero(column > 999)
    np.testing.assert_array_equal(full, np.arange(full[0], full[-1] + 1))


def test_without_blooming_the_excess_is_drained() -> None:
    quiet = {"read_noise_e": 0.0, "hot_pixels": 0, "black_level": 0.0, "full_well_e": 1000.0}
    light = np.full((1, 1), 20_000.0, np.float32)
    sensor = sensor_of(ideal_rig(camera={"bits": 16}, sensor=quiet))
    frame = sensor.expose([SpotImage(top=75, left=100, rate=light)], 1.0, 1.0, 0.0, generator(3, "f"))
    assert (frame > 0).sum() == 1
