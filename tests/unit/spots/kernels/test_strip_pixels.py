"""Level, noise and peaks of a strip against plain numpy and scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import correlate1d, maximum_filter

from tests.support.draw import Drawn, profile
from workbench.spots.kernels.strip_pixels import level_of, peaks_of

TAPS = np.array([0.05, 0.25, 0.4, 0.25, 0.05], np.float32)
EVERYWHERE = np.zeros((0, 0), bool)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_level_and_variance_are_those_of_the_pixels_between_the_cuts(seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = np.rint(rng.normal(40.0, 5.0, (30, 41))).astype(np.float32)
    values[rng.random(values.shape) < 0.1] += 200.0
    level, variance = level_of(values, values.size, 4.0, 1.0 / 12.0)
    ordered = np.sort(values.ravel())
    low, middle, high = (float(ordered[int(share * ordered.size)]) for share in (0.1587, 0.5, 0.8413))
    reach = 4.0 * min(middle - low, 0.5 * (high - low))
    inside = values[np.abs(values - middle) <= reach].astype(float)
    assert (level, variance) == pytest.approx((inside.mean(), inside.var()), rel=1e-9)
    # The bright tenth is far outside.
    assert abs(level - 40.0) < 1.0


@pytest.mark.parametrize("period", [2, 4, 8, 16])
def test_stripes_do_not_fall_in_step_with_the_sample(period: int) -> None:
    """A sample of every eighth pixel of 64 columns would see one phase of the stripes alone."""
    values = np.where(np.arange(64) % period < period // 2, 10.0, 12.0) * np.ones((64, 1))
    level, variance = level_of(values.astype(np.float32), values.size // 8, 4.0, 1.0 / 12.0)
    assert level == pytest.approx(11.0, abs=0.1)
    assert variance == pytest.approx(1.0, rel=0.05)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_peaks_are_the_local_maxima_of_the_filtered_strip(seed: int) -> None:
    rng = np.random.default_rng(seed)
    signal = rng.normal(0.0, 1.0, (25, 40)).astype(np.float32)
    smooth = correlate1d(correlate1d(signal, TAPS, 0, mode="nearest"), TAPS, 1, mode="nearest")
    tops = np.argwhere((smooth == maximum_filter(smooth, 3)) & (smooth > 0.5))
    # A valley of no depth leaves no ripple out.
    found = peaks_of(signal, TAPS, EVERYWHERE, 0.5, 1e-12, 100, 200)
    expected = sorted(tops.tolist(), key=lambda at: -smooth[tuple(at)])
    heights = [smooth[tuple(at)] for at in expected]
    deep = [n for n, at in enumerate(found.tolist()) if [at[0] - 100, at[1] - 200] in expected]
    assert len(deep) == len(found) > 5
    assert found[0, :2].tolist() == [expected[0][0] + 100, expected[0][1] + 200]
    assert (np.diff(found[:, 2]) <= 0).all()
    assert found[0, 2] == pytest.approx(heights[0], rel=1e-5)
    # Those that are missing are ripples: less than 8 % of their height above the way to a higher one.
    for row, col in expected:
        if [row + 100, col + 200] not in found[:, :2].tolist():
            assert smooth[row, col] < heights[0]


@pytest.mark.parametrize(("separation_px", "count"), [(2.0, 1), (4.0, 2), (30.0, 2)])
def test_a_valley_parts_two_peaks(separation_px: float, count: int) -> None:
    lights = [Drawn(20.0, 12.0, 5e3, 1.0, 1.0), Drawn(20.0 + separation_px, 12.0, 4e3, 1.0, 1.0)]
    signal = sum((profile((25, 60), light) for light in lights), np.zeros((25, 60))).astype(np.float32)
    assert len(peaks_of(signal, TAPS, EVERYWHERE, 10.0, 1.0, 0, 0)) == count


def test_a_shallow_valley_is_noise() -> None:
    """Two peaks of 100 DN with 10 DN between: deep enough for noise of 1 DN, not for 5 DN."""
    signal = np.zeros((9, 30), np.float32)
    signal[4, 8:21] = 90.0
    signal[4, [8, 20]] = 101.0, 100.0
    one = np.ones(1, np.float32)
    assert len(peaks_of(signal, one, EVERYWHERE, 50.0, 1.0, 0, 0)) == 2
    assert len(peaks_of(signal, one, EVERYWHERE, 50.0, 5.0, 0, 0)) == 1


def test_peaks_outside_the_mask_do_not_count() -> None:
    signal = np.zeros((9, 30), np.float32)
    signal[4, [5, 25]] = 50.0, 100.0
    mask = np.ones((9, 30), bool)
    mask[:, 20:] = False
    found = peaks_of(signal, np.ones(1, np.float32), mask, 10.0, 1.0, 0, 0)
    assert found.tolist() == [[4.0, 5.0, 50.0]]
