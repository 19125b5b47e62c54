"""Matched filter of residuals, compared with OpenCV's filters."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from workbench.spots.kernels.hidden import most_significant, smoothed

WINDOWS = [((17, 17), 1.5, 1.3), ((23, 41), 2.2, 3.1), ((11, 11), 0.7, 0.9), ((9, 60), 6.0, 0.5)]


@pytest.mark.parametrize(("shape", "along_u", "along_v"), WINDOWS)
def test_an_image_is_smoothed_as_by_opencv(shape: tuple[int, int], along_u: float, along_v: float) -> None:
    image = np.random.default_rng(3).normal(size=shape)
    theirs = cv2.GaussianBlur(image, (0, 0), sigmaX=along_u, sigmaY=along_v, borderType=cv2.BORDER_CONSTANT)
    np.testing.assert_allclose(smoothed(image, along_u, along_v), theirs, rtol=0, atol=1e-14)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize(("shape", "su", "sv"), WINDOWS)
def test_the_most_significant_place_is_that_of_filters_of_opencv(
    shape: tuple[int, int], su: float, sv: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    residual, weight = rng.normal(size=shape), rng.uniform(0.0, 2.0, shape)
    allowed = rng.random(shape) < 0.7
    residual[tuple(rng.integers(0, shape))] += 40.0  # hot
    neighbours = np.array([[1, 1, 1], [1, 0, 1], [1, 1, 1]], np.uint8)
    excess = weight * np.minimum(residual, cv2.dilate(residual, neighbours))
    constant = cv2.BORDER_CONSTANT
    matched = cv2.GaussianBlur(excess, (0, 0), sigmaX=su, sigmaY=sv, borderType=constant)
    narrow = cv2.GaussianBlur(weight, (0, 0), sigmaX=su / 2**0.5, sigmaY=sv / 2**0.5, borderType=constant)
    information = narrow / (4.0 * np.pi * su * sv)
    significance = np.where(allowed, matched / np.sqrt(information), 0.0)
    row, col = divmod(int(significance.argmax()), shape[1])
    found = most_significant(residual, weight, allowed, su, sv)
    assert found[1:3] == (row, col)
    assert found[0] == pytest.approx(significance[row, col], rel=1e-12)
    assert found[3] == pytest.approx(matched[row, col] / information[row, col], rel=1e-12)
