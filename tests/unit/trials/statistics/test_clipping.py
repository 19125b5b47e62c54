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


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("bias_mm", [0.0, 2.0, -2.0])
def test_the_level_without_scatter_of_a_coarse_sensor_is_not_clipped(seed: int, bias_mm: float) -> None:
    """Readings in steps of 1 mm, scatter that grows with the range: all readings at 100 mm are equal."""
    random = np.random.default_rng(seed)
    scatter_mm = {100.0: 0.1, 500.0: 1.0, 1000.0: 3.0, 2000.0: 10.0}
    rows = [
        {"standoff_mm": mm, "measured_mm": round(mm + bias_mm + random.normal(0.0, sd_mm))}
        for mm, sd_mm in scatter_mm.items()
        for _ in range(10)
    ]
    frame = pd.DataFrame(rows).astype(float)
    assert not clipped(frame).any()
    above = frame.assign(measured_mm=frame["measured_mm"].clip(upper=1500.0))
    assert (clipped(above) == (frame["standoff_mm"] > 1500).to_numpy()).all()


def test_a_single_true_range_and_missing_readings_are_not_clipped() -> None:
    assert not clipped(drawn_levels(1, [500.0]).assign(measured_mm=500.0)).any()
    assert not clipped(drawn_levels(1).assign(measured_mm=np.nan)).any()
