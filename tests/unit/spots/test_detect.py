"""Peaks of the smoothed signal: heights, places, and how seldom noise makes one."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.draw import Drawn, profile
from workbench.spots.detect import COARSE_PX, FINE_PX, PEAK_SD, find_peaks, smoothed_sd
from workbench.spots.strip import Strip

SHAPE = (60, 120)
WHOLE = Strip(slice(0, SHAPE[0]), slice(0, SHAPE[1]), None)


@pytest.mark.parametrize("scale_px", [FINE_PX, COARSE_PX])
@pytest.mark.parametrize("width_px", [1.0, 2.5])
def test_the_height_of_a_peak_is_that_of_two_gaussians_convolved(scale_px: float, width_px: float) -> None:
    signal = profile(SHAPE, Drawn(50.0, 30.0, 1e4, width_px, width_px)).astype(np.float32)
    peaks = find_peaks(signal, WHOLE, 1.0, scale_px)
    assert (peaks.rows.tolist(), peaks.cols.tolist()) == ([30.0], [50.0])
    # The pixel adds a twelfth to the spot's variance; the filter ends at 2.5 widths.
    expected = 1e4 / (2.0 * np.pi * (width_px**2 + 1.0 / 12.0 + scale_px**2))
    assert peaks.height_dn[0] == pytest.approx(expected, rel=0.04)


@pytest.mark.parametrize("scale_px", [FINE_PX, COARSE_PX])
def test_white_noise_has_the_stated_deviation_after_smoothing(scale_px: float) -> None:
    rng = np.random.default_rng(1)
    frame = rng.normal(0.0, 3.0, (400, 400))
    taps = np.exp(-0.5 * (np.arange(-9, 10) / scale_px) ** 2)
    taps /= taps.sum()
    rows = np.apply_along_axis(np.convolve, 1, frame, taps, "valid")
    smooth = np.apply_along_axis(np.convolve, 0, rows, taps, "valid")
    # Neighbouring pixels share their noise: some 4 pi scale^2 of them make one independent value.
    independent = smooth.size / (4.0 * np.pi * scale_px**2)
    assert smoothed_sd(9.0, scale_px) == pytest.approx(smooth.std(), rel=4 / np.sqrt(2 * independent))


@pytest.mark.parametrize(("scale_px", "width_px"), [(FINE_PX, 0.8), (COARSE_PX, 3.0)])
@pytest.mark.parametrize(("ratio", "found"), [(1.1, True), (0.9, False)])
def test_each_search_finds_spots_of_its_width_near_the_limit_of_a_matched_filter(
    scale_px: float, width_px: float, ratio: float, found: bool
) -> None:
    """Without noise. The flux over sqrt(4 pi) widths is the signal-to-noise ratio of a matched filter."""
    width = np.sqrt(width_px**2 + 1.0 / 12.0)
    snr = ratio * PEAK_SD / (2.0 * scale_px * width / (scale_px**2 + width**2))
    flux = snr * np.sqrt(4.0 * np.pi) * width
    signal = profile(SHAPE, Drawn(50.0, 30.0, flux, width_px, width_px)).astype(np.float32)
    assert bool(find_peaks(signal, WHOLE, 1.0, scale_px).rows.size) == found
    # A filter of nearly the spot's width loses 3 % of the ratio at most.
    assert PEAK_SD * ratio / snr > 0.97


def test_noise_alone_has_no_peak() -> None:
    rng = np.random.default_rng(2)
    for _ in range(20):
        noise = rng.normal(0.0, 2.0, SHAPE).astype(np.float32)
        assert find_peaks(noise, WHOLE, 4.0).rows.size == 0
        assert find_peaks(noise, WHOLE, 4.0, threshold_sd=2.0).rows.size > 0


def test_peaks_are_in_pixels_of_the_image_highest_first_and_inside_the_mask() -> None:
    spots = [Drawn(20.0, 10.0, 3e3), Drawn(60.0, 12.0, 9e3), Drawn(90.0, 25.0, 9e4)]
    light = sum((profile(SHAPE, spot) for spot in spots), np.zeros(SHAPE))
    rows, cols = slice(4, 40), slice(8, 110)
    mask = np.ones((36, 102), bool)
    mask[20 - 4 :] = False
    signal = light[rows, cols].astype(np.float32)
    peaks = find_peaks(signal, Strip(rows, cols, mask), 1.0)
    assert list(zip(peaks.cols.tolist(), peaks.rows.tolist(), strict=True)) == [(60.0, 12.0), (20.0, 10.0)]
