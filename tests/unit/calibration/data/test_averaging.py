"""Averages of repeats, and which of them are none."""

from __future__ import annotations

import numpy as np

from workbench.calibration.data.averaging import strays


def test_honest_repeats_are_hardly_ever_rejected() -> None:
    """As the comment of STRAY_SD says, also where the stated deviation is far too small."""
    rng = np.random.default_rng(5)
    draws = rng.normal(0.0, 1.0, (4000, 10, 2))
    far = sum(int(strays(d, np.full((10, 2), 1e-3)).sum()) for d in draws)
    right = sum(int(strays(d, np.full((10, 2), 1.0)).sum()) for d in draws)
    assert right == 0
    assert far < 2 * 4000 * 10 / 250
