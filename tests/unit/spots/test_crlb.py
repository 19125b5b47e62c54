"""The Fisher bound against differences, moments and limits known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.spots.crlb import CameraNoise, fisher_matrix, pixel_information, position_bound_px

FINE = CameraNoise(electrons_per_dn=0.5, read_sd_electrons=5.0, background_electrons=5.0)


@pytest.mark.parametrize("electrons", [0.5, 10.0, 100.0, 399.0])
def test_information_of_a_pixel_is_at_least_the_inverse_variance(electrons: float) -> None:
    # Of all distributions with this mean and variance, the Gaussian has the least information about the mean.
    least = 1.0 / (electrons + 25.0 + 0.25 / 12.0)
    information = pixel_information(electrons, FINE)
    assert least * (1 - 1e-3) <= information < 1.06 * least


@pytest.mark.parametrize("step", [1.0, 30.0, 90.0])
def test_rounding_counts_as_noise_evenly_spread_over_a_step(step: float) -> None:
    """Its variance is that of a uniform distribution."""
    offsets = np.linspace(-0.5, 0.5, 100_001) * step
    camera = CameraNoise(electrons_per_dn=step, read_sd_electrons=5.0, background_electrons=0.0)
    assert pixel_information(1000.0, camera) == pytest.approx(1.0 / (1000.0 + 25.0 + offsets.var()), rel=1e-4)


def test_information_of_a_pixel_agrees_with_the_score_of_simulated_numbers() -> None:
    rng, trials, step = np.random.default_rng(2), 400_000, 0.5
    camera = CameraNoise(1.0, 2.0, 0.0)
    bins = np.arange(-20, 80)

    def numbers(mean: float) -> np.ndarray:
        values = np.rint(rng.poisson(mean, trials) + rng.normal(0, 2.0, trials))
        return (
            np.bincount(np.clip(values - bins[0], 0, len(bins) - 1).astype(int), minlength=len(bins)) / trials
        )

    middle, up, down = numbers(20.0), numbers(20.0 + step), numbers(20.0 - step)
    seen = middle > 2e-4
    information = float(((up - down)[seen] ** 2 / (4 * step**2) / middle[seen]).sum())
    # Noise of the histograms adds about (number of bins) / (2 step^2 trials) to the sum.
    bias = seen.sum() / (2 * step**2 * trials)
    assert information - bias == pytest.approx(pixel_information(20.0, camera), rel=0.03)


def test_bright_wide_spot_reaches_the_shot_noise_limit() -> None:
    # Without read noise and with pixels small against the spot: sd = width / sqrt(electrons).
    camera = CameraNoise(1e-3, 1e-3, 1e-6)
    bound = position_bound_px(1e9, 4.0, (0.1, -0.3), camera)
    np.testing.assert_allclose(bound, np.sqrt(16.0 + 1.0 / 12.0) / np.sqrt(1e9), rtol=5e-3)


def test_read_noise_limit_is_the_sampled_one() -> None:
    # Constant noise s a pixel: sd = s * sqrt(8 pi) * width^2 / electrons, for pixels small against the spot.
    camera = CameraNoise(1e-3, 100.0, 1e-6)
    bound = position_bound_px(10.0, 4.0, (0.0, 0.0), camera)
    np.testing.assert_allclose(bound, 100.0 * np.sqrt(8 * np.pi) * 16.0 / 10.0, rtol=0.02)


def test_matrix_is_the_curvature_of_the_expected_log_likelihood() -> None:
    matrix = fisher_matrix(2e4, 1.2, (0.2, -0.1), FINE)
    assert np.linalg.eigvalsh(matrix).min() > 0
    np.testing.assert_allclose(matrix, matrix.T)
