"""Resolution of readings."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tests.support.trial_readings import drawn_levels
from workbench.trials.statistics.resolution import coarse_step


def rounded(step_mm: float, seed: int = 1, sd_mm: float = 0.3) -> pd.DataFrame:
    drawn = drawn_levels(seed, (500.0,), (1, 8, 5), (0.0, sd_mm, sd_mm))
    return drawn.assign(measured_mm=step_mm * np.round(drawn["measured_mm"] / step_mm))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_step_above_the_scatter_is_coarse(seed: int) -> None:
    assert coarse_step(rounded(1.0, seed)) == pytest.approx(1.0)
    assert coarse_step(rounded(0.02, seed)) is None


def test_readings_that_all_differ_have_no_step() -> None:
    assert coarse_step(drawn_levels(1, (500.0,))) is None


def test_equal_readings_state_no_step() -> None:
    assert coarse_step(pd.DataFrame({"measured_mm": [5.0] * 6, "placement": [0, 0, 1, 1, 2, 2]})) is None
