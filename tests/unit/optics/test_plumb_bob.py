"""The Brown-Conrady lens against OpenCV's and against differences."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.rigs import opencv_pixels
from workbench.optics.plumb_bob import PLUMB_BOB

LENS = np.array([541.3, 358.7, 235.0, 0.11, -0.07, 0.002, -0.003, 0.01])


def test_jax_computes_with_64_bits() -> None:
    assert PLUMB_BOB.project(LENS, 0.1, 0.2)[0].dtype == np.float64


def test_projection_is_opencv_s() -> None:
    points = np.random.default_rng(1).uniform([-400, -300, 800], [400, 300, 2000], (200, 3))
    ours = np.stack(PLUMB_BOB.project(LENS, points[:, 0] / points[:, 2], points[:, 1] / points[:, 2]), axis=1)
    np.testing.assert_allclose(ours, opencv_pixels("plumb_bob", LENS.tolist(), points), rtol=0, atol=1e-9)


def test_an_undistorted_lens_is_a_pinhole() -> None:
    u, v = PLUMB_BOB.project([500.0, 320.0, 240.0, *[0.0] * 5], 0.2, -0.1)
    assert (float(u), float(v)) == pytest.approx((420.0, 190.0), abs=1e-12)
