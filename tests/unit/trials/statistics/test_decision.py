"""Decision with guard bands, and tolerance factors."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from tests.support.statistics import spread
from workbench.trials.statistics.decision import decide, tolerance_factor


@pytest.mark.parametrize(
    ("error_mm", "decision"),
    [
        (0.0, "pass"),
        (0.75, "pass"),
        (-0.75, "pass"),
        (0.8, "neither"),
        (-1.2, "neither"),
        (1.25, "fail"),
        (-9.0, "fail"),
    ],
)
def test_guard_bands_leave_neither_between_pass_and_fail(error_mm: float, decision: str) -> None:
    assert decide(error_mm, 1.0, 0.25) == decision


def test_an_uncertainty_above_the_limit_never_passes() -> None:
    assert {decide(error, 1.0, 1.5) for error in np.linspace(-2.4, 2.4, 9)} == {"neither"}


@pytest.mark.parametrize(("mpe_mm", "expanded_mm"), [(0.0, 0.1), (1.0, -0.1), (1.0, np.nan), (np.inf, 0.1)])
def test_limits_that_decide_nothing_are_refused(mpe_mm: float, expanded_mm: float) -> None:
    with pytest.raises(ValueError, match="MPE"):
        decide(0.0, mpe_mm, expanded_mm)


def test_tolerance_factor_of_the_nist_handbook() -> None:
    assert tolerance_factor(43, 0.90, 0.99) == pytest.approx(2.217, abs=5e-4)


def test_tolerance_interval_holds_its_share_with_its_confidence() -> None:
    random, trials, n = np.random.default_rng(2), 4000, 12
    values = random.normal(0, 1, (trials, n))
    mean, half = values.mean(axis=1), tolerance_factor(n, 0.9, 0.95) * values.std(axis=1, ddof=1)
    held = norm.cdf(mean + half) - norm.cdf(mean - half) >= 0.9
    assert held.mean() == pytest.approx(0.95, abs=spread(0.95, trials))
