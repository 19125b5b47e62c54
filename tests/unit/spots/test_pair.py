"""The signal of a pair of frames: ambient light, level, noise."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.draw import Drawn, Sensor, draw
from tests.support.spot_models import scene_of
from workbench.spots import Failure, Scanline, find_spots
from workbench.spots.pair import Pair, _share_of_off
from workbench.spots.strip import Strip

ROW = [Scanline(0, 30, 1, 0, 3)]


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_a_change_of_ambient_light_is_reported_and_compensated() -> None:
    scene = np.where(np.arange(120) % 40 < 20, 300.0, 1500.0) * np.ones((60, 1))
    true = [Drawn(20.3, 30.2), Drawn(62, 30.2), Drawn(101.4, 29.8)]
    on, off = draw(true, rng(1), ambient=1.4 * scene), draw([], rng(2), ambient=scene)
    finding = find_spots(on, off, scanlines=ROW, expected=3)
    assert finding.failures == (Failure.AMBIENT_CHANGED,)
    for spot, t in zip(finding.spots, true, strict=True):
        assert spot.u_px == pytest.approx(t.u, abs=5 * spot.u_sd_px)


def test_steady_light_is_no_change() -> None:
    on, off = draw([Drawn(50, 30)], rng(1), ambient=200.0), draw([], rng(2), ambient=200.0)
    assert find_spots(on, off, scanlines=ROW, expected=1).failures == ()


def test_bars_of_light_do_not_pass_for_the_noise_of_the_frame() -> None:
    """Bright bars in the columns that a sample of every 256th pixel would come from."""
    scene = np.full((480, 640), 20.0)
    for column in range(0, 640, 128):
        scene[:, max(column - 2, 0) : column + 3] = 3000.0
    random = rng(3)
    true = Drawn(190.3, 240.2, 1.2e3, 1.5, 1.5)
    on, off = (
        draw([true], random, ambient=scene, shape=(480, 640)),
        draw([], random, (480, 640), ambient=scene),
    )
    (spot,) = find_spots(on, off, expected=1, saturation_dn=4095).spots
    assert spot.u_px == pytest.approx(true.u, abs=5 * spot.u_sd_px)


def frames(seed: int) -> tuple[np.ndarray, np.ndarray]:
    random = rng(seed)
    return random.integers(0, 4096, (40, 50)).astype(np.uint16), random.integers(0, 4096, (40, 50)).astype(
        np.uint16
    )


@pytest.mark.parametrize(("share", "level"), [(1.0, 0.0), (0.8, 12.5), (1.3, -4.0)])
def test_the_signal_is_on_less_the_share_of_off_less_the_level(share: float, level: float) -> None:
    on, off = frames(1)
    strip = Strip(slice(5, 20), slice(10, 45), None)
    expected = on[5:20, 10:45].astype(float) - share * off[5:20, 10:45] - level
    np.testing.assert_allclose(Pair(on, off, 4095.0, share, level).signal(strip), expected, atol=2e-3)
    without = on[5:20, 10:45].astype(float) - level
    np.testing.assert_allclose(Pair(on, None, 4095.0, share, level).signal(strip), without, atol=2e-3)


@pytest.mark.parametrize("has_off", [True, False])
def test_windows_are_cut_out_of_the_signal_and_end_at_the_border(has_off: bool) -> None:
    on, off = frames(2)
    pair = Pair(on, off if has_off else None, 3500.0, 0.9, 3.0)
    win = pair.cut(np.array([20.0, 1.0]), np.array([25.0, 48.0]), np.arange(2), 5)
    signal = on - (0.9 * off if has_off else 0.0) - 3.0
    np.testing.assert_allclose(win.data[0], signal[15:26, 20:31])
    np.testing.assert_array_equal(win.usable[0], on[15:26, 20:31] < 3500)
    # Rows from -4, columns up to 53: what lies outside is not usable.
    assert not win.usable[1, :4].any()
    assert not win.usable[1, :, 7:].any()
    np.testing.assert_array_equal(win.usable[1, 4:, :7], on[:7, 43:] < 3500)
    np.testing.assert_allclose(win.clip_dn[0] - win.data[0], 3500.0 - on[15:26, 20:31])


@pytest.mark.parametrize("factor", [0.6, 1.4])
def test_the_share_of_a_changed_light_is_found(factor: float) -> None:
    scene = np.where(np.arange(120) % 40 < 20, 300.0, 1500.0) * np.ones((60, 1))
    sensor = Sensor(electrons_per_dn=4.0, black_dn=0.0)
    on = draw([Drawn(50, 30)], rng(3), ambient=factor * scene, sensor=sensor)
    found = scene_of(on, draw([], rng(4), ambient=scene, sensor=sensor))
    assert found.ambient_changed
    assert found.pair.off_share == pytest.approx(factor, rel=0.02)
    assert np.median(found.signal) == pytest.approx(0.0, abs=0.5)


def test_a_frame_without_its_dark_one_loses_its_level() -> None:
    found = scene_of(draw([], rng(5), ambient=800.0))
    assert found.pair.level_dn == pytest.approx(10.0 + 800.0 / Sensor().electrons_per_dn, abs=0.6)
    assert not found.ambient_changed
    # Shot and read noise and rounding, DN^2.
    assert found.variance == pytest.approx((800.0 + 36.0) / 64.0 + 1.0 / 12.0, rel=0.25)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_spots_of_a_few_dn_on_bright_pixels_do_not_change_the_share(seed: int) -> None:
    """Whole numbers: beside rounding nothing scatters, and 4 DN are far out."""
    off = np.random.default_rng(seed).uniform(0.0, 200.0, 10_000)
    on = np.rint(0.8 * off) + 4.0 * (off > 196.0)
    # A spot on 2 % of the pixels would add 0.0023.
    assert _share_of_off(on, off) == pytest.approx(0.8, abs=0.25 * 0.0023)
