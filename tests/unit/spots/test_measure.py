"""From peaks to fitted spots: values, window sizes, flags, and what is dropped."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.draw import Drawn, Sensor, draw
from tests.support.spot_models import scene_of
from workbench.spots import Failure
from workbench.spots.detect import COARSE_PX, find_peaks
from workbench.spots.measure import first_guess, measure, spot_flags

SENSOR = Sensor()


@pytest.mark.parametrize("width_px", [0.7, 1.3, 2.5, 5.0])
@pytest.mark.parametrize("seed", [1, 2])
def test_a_spot_has_the_values_that_it_was_drawn_with(width_px: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    true = Drawn(60.3, 40.2, 2e5, width_px, width_px)
    scene = scene_of(draw([true], rng, (80, 120)), draw([], rng, (80, 120)))
    scale = COARSE_PX if width_px > 3 else 1.0
    (trace,) = measure(scene, find_peaks(scene.signal, scene.strip, scene.variance, scale))
    spot = trace.spot
    assert spot.u_px == pytest.approx(true.u, abs=4.5 * spot.u_sd_px)
    assert spot.v_px == pytest.approx(true.v, abs=4.5 * spot.v_sd_px)
    flux_dn = true.electrons / SENSOR.electrons_per_dn
    assert spot.flux_dn == pytest.approx(flux_dn, abs=4.5 * spot.flux_dn / trace.flux_snr)
    # The logarithm of a width is as uncertain as the flux relative to itself.
    assert np.log(spot.width_px / width_px) == pytest.approx(0.0, abs=4.5 / trace.flux_snr)
    assert trace.reach_px == pytest.approx(spot.width_px, rel=0.05)
    np.testing.assert_array_equal(trace.params[[1, 2, 3]], [spot.flux_dn, spot.u_px, spot.v_px])


def test_no_peak_is_no_spot() -> None:
    scene = scene_of(draw([], np.random.default_rng(3)))
    assert measure(scene, find_peaks(scene.signal, scene.strip, scene.variance)) == []


def test_a_hot_pixel_is_a_peak_and_no_spot() -> None:
    frame = draw([], np.random.default_rng(4)).copy()
    frame[30, 60] = 2000
    scene = scene_of(frame)
    peaks = find_peaks(scene.signal, scene.strip, scene.variance)
    assert (peaks.cols.tolist(), peaks.rows.tolist()) == ([60.0], [30.0])
    assert measure(scene, peaks) == []


def test_flags_tell_the_border_and_clipped_pixels() -> None:
    frame = np.zeros((60, 120), np.uint16)
    frame[30, 60] = frame[2, 100] = 4095
    scene = scene_of(frame)
    places = [(20.0, 30.0), (2.0, 30.0), (61.0, 30.0), (100.0, 2.0)]
    params = np.array([[0.0, 1e4, u, v, np.log(1.3), np.log(1.3)] for u, v in places])
    edge, clipped = {Failure.AT_EDGE}, {Failure.SATURATED}
    assert spot_flags(scene, params) == [set(), edge, clipped, edge | clipped]


def test_the_first_guess_of_a_wide_peak_is_what_the_search_was_matched_to() -> None:
    rng = np.random.default_rng(5)
    true = Drawn(60.0, 40.0, 1e5, 3.0, 3.0)
    scene = scene_of(draw([true], rng, (80, 120)))
    peaks = find_peaks(scene.signal, scene.strip, scene.variance, COARSE_PX)
    win = scene.pair.cut(peaks.rows, peaks.cols, np.arange(1), 13)
    start, scatter = first_guess(win, peaks)
    assert scatter == 1.0
    assert start[0, 2:] == pytest.approx([60.0, 40.0, np.log(3.0), np.log(3.0)])
    assert start[0, 1] == pytest.approx(1e5 / SENSOR.electrons_per_dn, rel=0.1)
