"""Deviation of a centre by speckle from data sheets, against simulated spots in speckle."""

from __future__ import annotations

import numpy as np
import pytest

from tests.benchmarks.render import Sensor, axis_share
from workbench.model.arrays import FloatArray
from workbench.model.rig import load_rig
from workbench.model.speckle import speckle_sd_px
from workbench.spots import SpotFinder

SIDE, FINE, SPOT_PX = 31, 12, 1.2
"""Side of a frame, samples a pixel, standard deviation of the spot, px."""
SPOTS = 150
SENSOR = Sensor(electrons_per_dn=40_000 / 255, read_sd_electrons=225.0, bits=8, black_dn=8.0)
PEAK_ELECTRONS = 130 * SENSOR.electrons_per_dn
"""A CCD of 8 bits and a usual exposure: the noise of a pixel decides how far out a fit still weighs it."""


def light_in_speckle(grain_px: float, at_px: FloatArray, rng: np.random.Generator) -> FloatArray:
    """(SIDE, SIDE) share of a spot's light, seen through a round pupil that passes random amplitudes."""
    frequency = np.fft.fftfreq(FINE * SIDE, 1.0 / FINE)
    passed = np.hypot(frequency[:, None], frequency) <= 0.5 / grain_px
    real, imaginary = rng.standard_normal((2, *passed.shape))
    amplitude = np.where(passed, real + 1j * imaginary, 0)
    pattern = np.abs(np.fft.ifft2(amplitude)) ** 2
    u, v = (axis_share(FINE * (x + 0.5) - 0.5, FINE * SPOT_PX, FINE * SIDE) for x in at_px)
    fine = v[:, None] * u * pattern / pattern.mean()
    return np.asarray(fine.reshape(SIDE, FINE, SIDE, FINE).sum(axis=(1, 3)))


@pytest.mark.parametrize(("nm", "f_number", "um"), [(650, 2, 7.5), (520, 4, 6), (850, 1.4, 10)])
def test_centres_of_simulated_spots_scatter_as_stated(nm: float, f_number: float, um: float) -> None:
    rng = np.random.default_rng(int(nm))
    stated = speckle_sd_px(nm, f_number, um)
    finder = SpotFinder((SIDE, SIDE), expected=1, speckle_sd_px=stated)
    dark, errors, centroids = np.zeros((SIDE, SIDE)), [], []
    for _ in range(SPOTS):
        at_px = 15.0 + rng.uniform(-0.5, 0.5, 2)
        share = light_in_speckle(nm * 1e-3 * f_number / um, at_px, rng)
        light = PEAK_ELECTRONS * 2 * np.pi * (SPOT_PX**2 + 1 / 12) * share
        pair = [finder.find(SENSOR.expose(light, rng), SENSOR.expose(dark, rng)).spots for _ in range(2)]
        errors.append([(spot.u_px - at_px[0], spot.v_px - at_px[1]) for (spot,) in pair])
        centroids.append([share.sum(axis=axis) @ np.arange(SIDE) / share.sum() for axis in (0, 1)] - at_px)
    # 300 values: 4 % of a deviation, 1 sigma. Speckle is what both frames of a pair share.
    assert np.sqrt(np.mean(np.square(centroids))) == pytest.approx(stated * 0.5**0.5 / 0.67, rel=0.16)
    # With the peak from 80 to 180 DN the factor of a fit goes from 1.2 to 0.8 of the stated one.
    shared = np.sqrt(np.prod(errors, axis=1).mean())
    assert shared == pytest.approx(stated, rel=0.25)


def test_thesis_rig_states_this_value() -> None:
    from tests.crash.short import ROOT

    stated = load_rig(ROOT / "rigs/thesis-emulated.yaml").noise.speckle_sd_px
    assert speckle_sd_px(650, 2, 7.5) == pytest.approx(stated, abs=5e-4)
