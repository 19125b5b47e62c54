"""Every function against the distribution of the same name in scipy.stats, tails included."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy import stats as scipy_stats

from workbench.model import stats

X = np.array([1e-6, 0.3, 1.0, 4.0, 30.0, 200.0])
Q = np.array([1e-12, 0.001, 0.05, 0.5, 0.999])


@pytest.mark.parametrize(
    ("ours", "theirs", "values", "parameters"),
    [
        (stats.chi2_sf, scipy_stats.chi2.sf, X, [(1,), (7,), (2.5,)]),
        (stats.chi2_isf, scipy_stats.chi2.isf, Q, [(1,), (7,), (2.5,)]),
        (stats.f_sf, scipy_stats.f.sf, X, [(1, 5), (4, 30.5)]),
        (stats.t_cdf, scipy_stats.t.cdf, np.concatenate((-X, X)), [(1,), (12.5,)]),
        (stats.t_ppf, scipy_stats.t.ppf, Q[1:], [(1,), (12.5,)]),
        (stats.f_ppf, scipy_stats.f.ppf, Q[1:], [(1, 5), (4, 30.5)]),
        (stats.norm_cdf, scipy_stats.norm.cdf, np.concatenate((-X[:4], X)), [()]),
        (stats.norm_ppf, scipy_stats.norm.ppf, Q, [()]),
        (stats.gamma_cdf, scipy_stats.gamma.cdf, X, [(0.5,), (3.0,)]),
        (stats.gamma_sf, scipy_stats.gamma.sf, X, [(0.5,), (3.0,)]),
    ],
)
def test_same_as_scipy_stats(
    ours: Callable[..., Any], theirs: Callable[..., Any], values: Any, parameters: list[tuple[float, ...]]
) -> None:
    for given in parameters:
        np.testing.assert_allclose(ours(values, *given), theirs(values, *given), rtol=1e-9, atol=1e-300)
