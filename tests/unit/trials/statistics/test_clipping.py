"""Readings clipped at the end of a sensor's scale."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tests.support.trial_readings import drawn_levels
from workbench.trials.statistics.clipping import clipped


def limited(low: float, high: float, seed: int = 1) -> pd.DataFrame:
    frame = drawn_levels(seed)
    return frame.assign(measured_mm=frame["measured_mm"].clip(low, high))


@pytest.mark.parametrize(
    ("low", "high", "standoff_mm"), [(0, 1000.0, 1000), (0, 995.0, 1000), (300.1, 2000, 300)]
)
def test_repeated_extremes_are_clipped_at_either_end(low: float, high: float, standoff_mm: float) -> None:
    frame = limited(low, high)
    at_limit = frame["measured_mm"].isin([low, high]).to_numpy()
    assert at_limit.sum() >= 3
    assert (clipped(frame) == at_limit).all()
    assert set(frame["standoff_mm"][at_limit]) == {standoff_mm}


def test_one_limit_at_two_true_ranges_is_clipped_at_both() -> None:
    frame = limited(0, 500.0)
    assert (clipped(frame) == (frame["standoff_mm"] > 500).to_numpy()).all()


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("resolution_mm", [1e-6, 0.1, 1.0, 5.0])
def test_resolution_alone_is_not_clipping(seed: int, resolution_mm: float) -> None:
    frame = drawn_levels(seed)
    rounded = frame.assign(measured_mm=(frame["measured_mm"] / resolution_mm).round() * resolution_mm)
    assert not clipped(rounded).any()


def test_a_single_true_range_and_missing_readings_are_not_clipped() -> None:
    assert not clipped(drawn_levels(1, [500.0]).assign(measured_mm=500.0)).any()
    assert not clipped(drawn_levels(1).assign(measured_mm=np.nan)).any()
