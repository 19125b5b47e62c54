"""Simulated sensors of the public interface."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import workbench as wb

RIG = Path(__file__).parents[3] / "rigs/thesis-emulated.yaml"
STANDOFFS = (160.0, 400.0, 1400.0, 4500.0)


@pytest.fixture(scope="module")
def simulation() -> wb.Simulation:
    return wb.simulate(RIG, n=32, seed=3, standoffs=STANDOFFS, ranges_mm=[300, 1000])


def test_parameters_and_ranges_of_every_sensor(simulation: wb.Simulation) -> None:
    parameters = wb.design(RIG, standoffs=STANDOFFS).parameters.index
    assert simulation.parameters.groupby("sensor")["parameter"].agg(list).tolist() == [list(parameters)] * 32
    assert len(simulation.ranges) == 32 * 4 * 2
    assert simulation.ranges.iloc[5][["laser_id", "range_mm"]].tolist() == ["L2", 1000.0]
    assert simulation.ranges["error_mm"].notna().mean() > 0.9


def test_equal_seeds_give_equal_results(simulation: wb.Simulation) -> None:
    again, other = (
        wb.simulate(RIG, n=32, seed=seed, standoffs=STANDOFFS, ranges_mm=[300, 1000]) for seed in (3, 4)
    )
    pd.testing.assert_frame_equal(again.ranges, simulation.ranges)
    assert not np.allclose(other.parameters["true"], simulation.parameters["true"])


def test_stated_uncertainty_is_that_of_the_design(simulation: wb.Simulation) -> None:
    expected = wb.design(RIG, standoffs=STANDOFFS).parameters["sd"]
    stated = simulation.parameters.groupby("parameter")["sd"].median()
    np.testing.assert_allclose(stated[expected.index], expected, rtol=0.3)


@pytest.mark.parametrize("standoffs", [[], [0.0], [400.0, -1.0], [5.0]])
def test_standoffs_without_a_spot_are_refused(standoffs: list[float]) -> None:
    with pytest.raises(wb.BadInputError):
        wb.simulate(RIG, n=2, standoffs=standoffs)
