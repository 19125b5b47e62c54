"""Test of the bias with the full covariance over standoffs, and E_n."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

from tests.support.statistics import spread
from workbench.model.arrays import FloatArray
from workbench.trials.statistics.bias import ErrorSources, bias_test, en_score
from workbench.trials.statistics.estimate import TooFewReadingsError

STANDOFFS_MM = np.array([300.0, 800.0, 2000.0, 4000.0])


def sources(scale: float = 1e-3) -> ErrorSources:
    """A calibration whose errors grow with the square of the range, common to all standoffs."""
    curve = 1e-7 * STANDOFFS_MM**2
    return ErrorSources(
        standoffs_mm=STANDOFFS_MM,
        calibration=np.outer(curve, curve) + np.diag((0.3 * curve) ** 2),
        placement_mm=np.full(4, 0.4),
        placements=np.full(4, 2.0),
        repeatability_mm=2e-4 * STANDOFFS_MM,
        readings=np.full(4, 10.0),
        scale=scale,
    )


def test_covariance_has_each_source_with_its_number_of_readings() -> None:
    one = sources()
    found = one.covariance()
    assert found[0, 1] == pytest.approx(one.calibration[0, 1] + 1e-6 * 300 * 800)
    assert found[0, 0] == pytest.approx(
        one.calibration[0, 0] + 0.4**2 / 2 + (2e-4 * 300) ** 2 / 10 + 1e-6 * 300**2
    )


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_five_percent_of_true_sensors_fail_together(seed: int) -> None:
    covariance, trials = sources().covariance(), 3000
    errors = multivariate_normal(np.zeros(4), covariance).rvs(trials, random_state=seed)
    p = np.array([bias_test(one, covariance).probability for one in errors])
    assert (p < 0.05).mean() == pytest.approx(0.05, abs=spread(0.05, trials))
    assert (p < 0.5).mean() == pytest.approx(0.5, abs=spread(0.5, trials))


def test_standoffs_without_correlation_add_their_squares() -> None:
    errors, sd = np.array([0.3, -0.4]), np.array([0.2, 0.1])
    found = bias_test(errors, np.diag(sd**2))
    assert found.z == pytest.approx([1.5, -4.0])
    assert found.chi2 == pytest.approx(18.25)
    assert found.degrees_of_freedom == 2


def test_an_error_common_to_all_standoffs_counts_once() -> None:
    common = np.ones((3, 3))
    found = bias_test(np.full(3, 1.5), common)
    assert found.chi2 == pytest.approx(2.25)
    assert found.degrees_of_freedom == 1
    assert found.probability == pytest.approx(2 * norm.sf(1.5))


def test_no_standoff_is_refused() -> None:
    empty: FloatArray = np.empty(0)
    with pytest.raises(TooFewReadingsError):
        bias_test(empty, np.empty((0, 0)))


def test_en_score_compares_expanded_uncertainties() -> None:
    assert en_score(500.8, 500.0, 0.6, 0.8) == pytest.approx(0.8)
    with pytest.raises(ValueError, match="uncertainty"):
        en_score(1.0, 0.0, 0.0, 0.0)


def test_a_further_common_source_is_correlated_over_standoffs() -> None:
    tilt_mm = np.array([[0.5], [-0.2], [0.0], [0.1]])
    with_tilt = replace(sources(), common_mm=tilt_mm).covariance()
    assert with_tilt - sources().covariance() == pytest.approx(tilt_mm @ tilt_mm.T)
