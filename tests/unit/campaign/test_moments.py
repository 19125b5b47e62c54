"""Statistics added up by chunks, compared with those of all values at once."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from workbench.campaign.moments import QUANTILE, Moments, ZHistogram, coverage_chart, z_chart


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_moments_are_those_of_all_values(seed: int) -> None:
    rng = np.random.default_rng(seed)
    sd = rng.uniform(0.5, 2.0, 400)
    error = rng.normal(0.1, sd)
    error[:3], error[3] = np.nan, np.inf
    moments = Moments()
    for part in np.array_split(np.arange(400), 7):
        moments.add(pd.Series(error[part]), pd.Series(sd[part]))
    finite = np.isfinite(error)
    assert (moments.count, moments.infinite) == (397, 1)
    assert moments.mean_error == pytest.approx(error[finite].mean())
    assert moments.rms_error == pytest.approx(np.sqrt((error[finite] ** 2).mean()))
    assert moments.stated_sd == pytest.approx(np.sqrt((sd[finite] ** 2).mean()))
    inside = (np.abs(error[finite]) < stats.norm.isf(0.025) * sd[finite]).sum()
    assert moments.coverage == inside / 397
    doubled = Moments.together([moments, moments])
    assert (doubled.count, doubled.coverage) == (794, moments.coverage)


def test_the_quantile_is_that_of_the_normal_distribution() -> None:
    assert pytest.approx(stats.norm.isf(0.025), rel=1e-12) == QUANTILE


def test_the_histogram_of_normal_values_is_their_density() -> None:
    histogram = ZHistogram()
    z = np.random.default_rng(4).normal(size=100_000)
    for part in np.array_split(z, 9):
        histogram.add(part)
    chart = z_chart({"drawn": histogram})
    drawn, normal = chart.series
    share = np.diff(stats.norm.cdf(np.linspace(-5, 5, 41)))
    spread = np.sqrt(share * (1 - share) / len(z)) / 0.25
    assert (np.abs(np.array(drawn.y, float) - share / 0.25) < 4.5 * spread + 1e-12).all()
    assert np.array(normal.y, float) == pytest.approx(stats.norm.pdf(np.array(normal.x)))


def test_coverage_has_the_band_of_chance() -> None:
    moments = Moments(count=1900, covered=1805)
    chart = coverage_chart({"L1": {100.0: moments, 200.0: Moments()}})
    assert chart.series[0].x == (100.0,)
    assert chart.series[0].y == (95.0,)
    # 3 sd of a binomial share: 3 sqrt(0.95 * 0.05 / 1900) = 1.5 %.
    assert chart.bands[0].low == pytest.approx((93.5,))
    assert chart.bands[0].high == pytest.approx((96.5,))
