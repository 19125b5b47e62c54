"""Bias, coverage and Fisher ratio on a small grid; `make bench` does the large one."""

from __future__ import annotations

import numpy as np
import pytest

from tests.benchmarks.speckle import measure_cell
from tests.support.draw import Drawn, Sensor, draw
from workbench.spots import Scanline, find_spots
from workbench.spots.crlb import CameraNoise, position_bound_px
from workbench.spots.psf import derivatives

SENSOR = Sensor()
COLUMNS = (25.0, 70.0, 115.0, 160.0)
FRAMES = 40
# Of n squared normal numbers the mean has sd sqrt(2 / n); the root half of that. Four sd: once in 16000.
VALUES = 2 * FRAMES * len(COLUMNS)
RMS_MARGIN = 4.0 * 0.5 * np.sqrt(2.0 / VALUES)


def measured(width: float, electrons: float, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    errors, sds, phases = [], [], []
    for _ in range(FRAMES):
        drawn = [
            Drawn(u + rng.uniform(-0.5, 0.5), 25 + rng.uniform(-0.5, 0.5), electrons, width, width)
            for u in COLUMNS
        ]
        frame = draw(drawn, rng, (51, 186), SENSOR, 5.0)
        spots = find_spots(frame, scanlines=[Scanline(0, 25, 1, 0, 3)], expected=4, saturation_dn=4095).spots
        assert len(spots) == len(drawn)
        for spot, true in zip(spots, drawn, strict=True):
            errors.append((spot.u_px - true.u, spot.v_px - true.v))
            sds.append((spot.u_sd_px, spot.v_sd_px))
            phases.append((true.u % 1, true.v % 1))
    return np.array(errors), np.array(sds), np.array(phases)


@pytest.mark.parametrize(
    ("width", "electrons", "seed"), [(0.6, 1e4, 1), (1.0, 1e3, 2), (1.5, 1e5, 3), (3.0, 1e4, 4)]
)
def test_centre_at_the_fisher_bound_with_an_honest_deviation(
    width: float, electrons: float, seed: int
) -> None:
    errors, sds, phases = measured(width, electrons, seed)
    camera = CameraNoise(SENSOR.electrons_per_dn, SENSOR.read_sd, 5.0)
    bounds = [position_bound_px(electrons, width, (u - 0.5, v - 0.5), camera) for u, v in phases[:8]]
    ratio = np.sqrt((errors**2).mean() / np.mean(np.square(bounds)))
    assert 1 - RMS_MARGIN < ratio < 1.15 + RMS_MARGIN
    assert np.std(errors / sds) == pytest.approx(1.0, abs=0.05 + RMS_MARGIN)
    wave = np.sin(2 * np.pi * phases).ravel()
    assert abs((errors.ravel() * wave).mean() * 2) < 0.005 + 4 * errors.std() * np.sqrt(2 / VALUES)
    assert abs(errors.mean()) < 4 * errors.std() / np.sqrt(VALUES)


@pytest.mark.parametrize("angle", [0.0, 0.6, -0.8])
def test_ellipses_are_measured_as_honestly(angle: float) -> None:
    rng = np.random.default_rng(5)
    z: list[float] = []
    for _ in range(60):
        true = Drawn(30 + rng.uniform(-0.5, 0.5), 30 + rng.uniform(-0.5, 0.5), 3e4, 2.4, 1.2, angle)
        (spot,) = find_spots(draw([true], rng, (61, 61), SENSOR, 5.0), expected=1, saturation_dn=4095).spots
        z += [(spot.u_px - true.u) / spot.u_sd_px, (spot.v_px - true.v) / spot.v_sd_px]
    # 120 values: the deviation of z has an sd of 1 / sqrt(240).
    assert np.std(z) == pytest.approx(1.0, abs=0.05 + 4 / np.sqrt(240))


def test_saturation_widens_the_deviation_as_the_lost_pixels_demand() -> None:
    rng = np.random.default_rng(6)
    low, high = Sensor(bits=10), Sensor(bits=14)
    z, ratios, demanded = [], [], []
    for _ in range(40):
        true = Drawn(30 + rng.uniform(-0.5, 0.5), 30 + rng.uniform(-0.5, 0.5), 1e6, 1.6, 1.6)
        seed = int(rng.integers(1 << 30))
        sds = {}
        for sensor in (low, high):
            frame = draw([true], np.random.default_rng(seed), (61, 61), sensor, 5.0)
            finding = find_spots(frame, expected=1, saturation_dn=2**sensor.bits - 1)
            (spot,) = finding.spots
            sds[sensor.bits] = spot.u_sd_px
            assert ("saturated" in spot.flags) == ("saturated" in finding.failures) == (sensor is low)
            if sensor is low:
                z.append((spot.u_px - true.u) / spot.u_sd_px)
        ratios.append(sds[10] / sds[14])
        demanded.append(lost_to_clipping(true, low))
    # A window's slope is measured from some tens of pixels: a few per cent in the mean of 40 ratios.
    assert np.mean(ratios) == pytest.approx(np.mean(demanded), rel=0.15)
    assert np.mean(demanded) > 1.15
    # 40 values: the deviation of z has an sd of 1 / sqrt(80).
    assert np.std(z) == pytest.approx(1.0, abs=0.05 + 4 / np.sqrt(80))


def lost_to_clipping(true: Drawn, sensor: Sensor) -> float:
    """Bound of u without the pixels that clip, over the bound with all."""
    params = np.array([[0.0, 1.0, true.u, true.v, np.log(1.6), np.log(1.6)]])
    rows = derivatives(params, (61, 61))[0].reshape(6, -1)
    mean = 5.0 + true.electrons * rows[1]
    weight = 1.0 / (mean + sensor.read_sd**2 + sensor.electrons_per_dn**2 / 12)
    whole = mean < (2**sensor.bits - 1 - sensor.black_dn) * sensor.electrons_per_dn
    bounds = [np.linalg.inv((rows * (weight * kept)) @ rows.T)[2, 2] ** 0.5 for kept in (whole, 1.0)]
    return float(bounds[0] / bounds[1])


def test_twelve_bits_in_sixteen_clip_at_their_own_full_scale() -> None:
    frame = draw([Drawn(30, 30, 4e6, 1.6, 1.6)], np.random.default_rng(7), (61, 61))
    (spot,) = find_spots(frame).spots
    assert frame.dtype == np.uint16
    assert "saturated" in spot.flags
    assert spot.u_px == pytest.approx(30, abs=5 * spot.u_sd_px)


@pytest.mark.parametrize(("apart", "over", "seed"), [(3.0, 4.0, 31), (4.0, 1.3, 32), (6.0, 2.0, 33)])
def test_clipped_neighbours_are_measured_as_honestly(apart: float, over: float, seed: int) -> None:
    """Fitted together, they leave out the pixels that are clipped, but not those that might have been."""
    rng, sensor, width, pairs = np.random.default_rng(seed), Sensor(40.0, 6.0, 8), 1.8, 150
    electrons = over * (255 - sensor.black_dn) * sensor.electrons_per_dn * 2.0 * np.pi * width**2
    z: list[float] = []
    for _ in range(pairs):
        u, v = 40 + rng.uniform(-0.5, 0.5), 30 + rng.uniform(-0.5, 0.5)
        places = ((u, v), (u + apart * width, v + rng.uniform(-0.3, 0.3)))
        drawn = [Drawn(*place, electrons * rng.uniform(0.9, 1.2), width, width) for place in places]
        found = find_spots(draw(drawn, rng, sensor=sensor), draw([], rng, sensor=sensor)).spots
        spots = sorted(found, key=lambda spot: spot.u_px)
        assert len(spots) == 2
        assert all("saturated" in spot.flags for spot in spots)
        outwards = zip(spots, drawn, (-1.0, 1.0), strict=True)
        z.extend(sign * (spot.u_px - true.u) / spot.u_sd_px for spot, true, sign in outwards)
    assert np.std(z) == pytest.approx(1.0, abs=0.05 + 4 * np.sqrt(0.5 / len(z)))
    assert abs(np.mean(z)) < 0.1 + 4 / np.sqrt(len(z))


@pytest.mark.parametrize(("width_px", "peak_dn", "seed"), [(0.75, 120.0, 1), (1.5, 60.0, 2), (1.5, 180.0, 3)])
def test_noise_and_speckle_are_stated_each_for_itself(width_px: float, peak_dn: float, seed: int) -> None:
    """Repeats scatter by the noise; single frames and means of repeats are off by the speckle as well."""
    cell = measure_cell(width_px, peak_dn, 1, seed, placements=120)
    # Patterns are independent between placements and axes: 240 values.
    margin = 4.0 * np.sqrt(0.5 / 240)
    assert cell.z_single == pytest.approx(1.0, abs=0.05 + margin)
    assert cell.z_mean == pytest.approx(1.0, abs=0.08 + margin)
    assert cell.noise_sd_px == pytest.approx(cell.scatter_px, rel=0.12 + 4.0 * np.sqrt(0.5 / 960))
    assert cell.lost == 0
