"""Photon-transfer slope measured from residuals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import j1

from tests.support.spot_models import ROUND, drawn_windows, pixel_noise
from workbench.model.arrays import FloatArray
from workbench.spots.fit import fit_spots
from workbench.spots.kernels.columns import FLUX
from workbench.spots.kernels.photon_transfer import measure_variance, shared_grains


@pytest.mark.parametrize("tilted", [False, True])
def test_the_slope_of_the_light_s_variance_is_measured(tilted: bool) -> None:
    params = ROUND.copy()
    params[:, FLUX] = 4e4
    params = np.append(params, [[0.3]], axis=1) if tilted else params
    noise = pixel_noise(4.0, 1.3)
    seeds = range(60)
    fits = [fit_spots(drawn_windows(params, (15, 15), seed), params, noise) for seed in seeds]
    slopes = [fit.noise.slope_dn[0] for fit in fits]
    # The variance of the light was drawn with a slope of 1, the fit starts at 1.3. With some forty telling
    # pixels a window the mean is known to sqrt(2 / 40 / 60) = 2.9 %.
    assert np.mean(slopes) == pytest.approx(1.0, abs=4 * np.sqrt(2 / 40 / 60))


def measured(
    contrast2: float, stated_contrast2: float, seed: int, residual_scale: float = 1.0, absorbed: float = 0.0
) -> tuple[float, float]:
    """Slope and squared contrast measured in one window with a floor of 4 DN^2, drawn with 0.5 DN.

    The slope is assumed as 0.5 DN. A fit that absorbs a share of the noise leaves the leverage `absorbed`.
    """
    rng = np.random.default_rng(seed)
    signal = rng.uniform(1.0, 400.0, (1, 60, 60))
    variance = 4.0 + 0.5 * signal + contrast2 * signal**2
    residual = residual_scale * rng.normal(0.0, np.sqrt(variance))
    slope, found = np.full(1, 0.5), np.full(1, stated_contrast2)
    measure_variance(
        signal,
        signal**2,
        residual,
        1.0 / variance,
        absorbed * variance,
        np.full(1, 4.0),
        slope,
        found,
        stated_contrast2,
    )
    return float(slope[0]), float(found[0])


@pytest.mark.parametrize("absorbed", [0.0, 0.2, 0.5])
@pytest.mark.parametrize("stated_contrast2", [0.0, 0.02])
def test_what_the_fit_absorbs_of_the_noise_is_counted(absorbed: float, stated_contrast2: float) -> None:
    """A fit of leverage h leaves residuals whose variance is 1 - h of the pixel's."""
    _, found = measured(0.01, stated_contrast2, 3, np.sqrt(1.0 - absorbed), absorbed)
    # Of 3600 pixels nine of ten are speckle's; the stated contrast counts as four.
    assert found == pytest.approx(0.01, rel=4.5 * np.sqrt(2 / 3000) + 4 / 3000)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_without_speckle_the_contrast_is_next_to_nothing(seed: int) -> None:
    slope, found = measured(0.0, 0.0, seed)
    # Both terms are determined by some thousand pixels each.
    assert slope == pytest.approx(0.5, rel=0.15)
    assert found < 0.5 / 400.0 * 0.15


@pytest.mark.parametrize(("residual_scale", "expected"), [(0.0, 1.0 / 30.0)])
def test_the_slope_stays_within_a_factor_of_thirty(residual_scale: float, expected: float) -> None:
    slope, found = measured(0.0, 0.0, 3, residual_scale)
    assert slope == pytest.approx(0.5 * expected, rel=0.01)
    assert found == 0.0


def test_a_stated_contrast_stands_where_the_spot_is_too_dim_to_measure_it() -> None:
    rng = np.random.default_rng(4)
    signal = rng.uniform(0.0, 2.0, (1, 11, 11))
    slope, found = np.full(1, 0.02), np.full(1, 0.04)
    one = np.ones_like(signal)
    measure_variance(
        signal,
        signal**2,
        rng.normal(0.0, 2.0, signal.shape),
        0.25 * one,
        0.0 * one,
        4.0 * np.ones(1),
        slope,
        found,
        0.04,
    )
    assert found[0] == pytest.approx(0.04, rel=0.1)


@pytest.mark.parametrize("grain_px", [0.1, 0.1733, 0.3])
def test_grains_on_the_border_of_pixels_raise_the_variance_of_sums(grain_px: float) -> None:
    """Against the integral of the autocorrelation of speckle behind a round pupil, over two pixels."""
    edge = np.linspace(0.0, 1.0, 801) ** 1.5
    x, width = 0.5 * (edge[1:] + edge[:-1]), np.diff(edge)
    z = np.pi * np.hypot(x[:, None], x) / grain_px
    by_area = 4.0 * (2.0 * j1(z) / z) ** 2 * np.outer(width, width)
    contrast2 = float((by_area * np.outer(1.0 - x, 1.0 - x)).sum())
    of_all = 4.0 / np.pi * grain_px**2
    assert shared_grains(contrast2) == pytest.approx(of_all / contrast2, rel=0.01)


PEAKED = np.exp(-np.hypot(*np.mgrid[-10:11, -10:11]) / 5.0)[None]
"""A window (1, 21, 21) whose highest pixel is in its middle."""


def measured_exactly(
    slope_dn: tuple[float, ...],
    contrast2: float,
    *,
    assumed_slope_dn: float,
    stated_contrast2: float = 0.0,
    floor: float = 1e-6,
    signal: FloatArray = 400.0 * PEAKED,
) -> tuple[FloatArray, FloatArray]:
    """Slope and squared contrast of windows whose every squared residual is its expectation."""
    n = len(slope_dn)
    signals = np.repeat(signal, n, axis=0)
    variance = floor + np.array(slope_dn)[:, None, None] * signals + contrast2 * signals**2
    slope, found = np.full(n, assumed_slope_dn), np.full(n, stated_contrast2)
    measure_variance(
        signals,
        signals**2,
        np.sqrt(variance),
        1.0 / variance,
        np.zeros_like(signals),
        np.full(n, floor),
        slope,
        found,
        stated_contrast2,
    )
    return slope, found


@pytest.mark.parametrize("contrast2", [0.0, 0.005, 0.05])
def test_slope_and_contrast_are_raised_for_the_number_of_pixels(contrast2: float) -> None:
    """All variance is the light's: every pixel counts as one, whatever the share of speckle."""
    slope, found = measured_exactly((0.5,), contrast2, assumed_slope_dn=0.5)
    factor = 1.0 + 2.0 / (PEAKED.size + 2.0)
    assert slope[0] == pytest.approx(0.5 * factor, rel=1e-4)
    assert found[0] == pytest.approx(contrast2 * factor, rel=1e-4, abs=1e-9)


def test_with_a_stated_contrast_nothing_is_raised() -> None:
    slope, found = measured_exactly((0.5,), 0.05, assumed_slope_dn=0.5, stated_contrast2=0.05)
    assert (slope[0], found[0]) == pytest.approx((0.5, 0.05), rel=1e-6)


@pytest.mark.parametrize(("assumed_slope_dn", "slope_dn"), [(0.1, 1.0), (2.0, 0.2)])
def test_many_pixels_overrule_the_assumed_slope(assumed_slope_dn: float, slope_dn: float) -> None:
    slope, found = measured_exactly((slope_dn,), 0.0, assumed_slope_dn=assumed_slope_dn)
    assert slope[0] == pytest.approx(slope_dn, rel=0.02)
    assert found[0] == 0.0


def test_windows_of_like_variance_are_pooled_and_one_far_above_is_not() -> None:
    """The third window has a misfit; its own variance stays its own."""
    slope, _ = measured_exactly((0.5, 1.0, 3.0), 0.0, assumed_slope_dn=0.5)
    assert slope[0] == slope[1] == pytest.approx(0.75, rel=0.01)
    assert slope[2] == pytest.approx(3.0, rel=0.02)


def test_a_window_without_a_peak_inside_is_not_pooled() -> None:
    signal = 400.0 * PEAKED
    slope, _ = measured_exactly((0.5, 1.0), 0.0, assumed_slope_dn=0.5, signal=np.roll(signal, 10, axis=2))
    assert slope == pytest.approx([0.5, 1.0], rel=0.02)


@pytest.mark.parametrize(("sds", "counts"), [(2.0, False), (4.5, True)])
def test_a_contrast_counts_where_it_is_significant(sds: float, counts: bool) -> None:
    """Its standard deviation, with the slope free, is that of a weighted linear fit to squared residuals."""
    m, floor, slope_dn = 400.0 * PEAKED.ravel(), 4.0, 0.5
    # The variance of a squared residual is twice the squared variance.
    terms = np.stack([m, m**2], axis=1) / (np.sqrt(2.0) * (floor + slope_dn * m))[:, None]
    contrast2 = sds * float(np.sqrt(np.linalg.inv(terms.T @ terms)[1, 1]))
    _, found = measured_exactly((slope_dn,), contrast2, assumed_slope_dn=slope_dn, floor=floor)
    assert (found[0] > 0.0) == counts
