"""The latest placement against its prediction: a misread ruler, and sound placements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.rigs import World
from workbench.calibration.data.observations import Observation
from workbench.calibration.design.latest_standoff import LatestStandoff, latest_standoff
from workbench.model.rig import load_rig
from workbench.model.stats import chi2_isf

RIG = load_rig(Path(__file__).parents[4] / "rigs/thesis-emulated.yaml")
ORDER = (1400.0, 280.0, 210.0, 3200.0, 400.0, 4500.0, 160.0, 125.0, 2200.0, 900.0, 600.0)
"""The standoffs of the shipped procedure, in its order."""
BLUNDER_MM = 25.0


def until(observations: Sequence[Observation], count: int, misread_mm: float = 0.0) -> list[Observation]:
    """Observations of the first placements; the ruler was misread at the last one."""
    last = ORDER[count - 1]
    return [
        replace(one, standoff_mm=last + misread_mm) if one.standoff_mm == last else one
        for one in observations
        if one.standoff_mm in ORDER[:count]
    ]


def compared(seed: int, count: int, misread_mm: float = 0.0) -> LatestStandoff | None:
    observations = until(World(RIG, seed).observations(ORDER, 5), count, misread_mm)
    return latest_standoff(RIG, observations, f"{ORDER[count - 1]:g}", len(ORDER))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("count", [n for n, mm in enumerate(ORDER, start=1) if n > 3 and mm < 1000.0])
def test_a_misread_ruler_contradicts_the_earlier_placements(seed: int, count: int) -> None:
    found = compared(seed, count, BLUNDER_MM)
    assert found is not None
    assert found.contradicts
    assert found.error_mm == pytest.approx(-BLUNDER_MM, abs=5 * found.sd_mm)
    assert found.earlier == count - 1


def test_p_values_of_sound_placements_are_uniform() -> None:
    """Fisher's combination over seeds and counts; nearly independent, as innovations of a fit are."""
    p = [found.p for seed in range(8) for n in range(4, 12) if (found := compared(seed, n)) is not None]
    assert len(p) == 64
    statistic = float(-2 * np.log(p).sum())
    assert chi2_isf(0.9995, 2 * len(p)) < statistic < chi2_isf(0.0005, 2 * len(p))
    assert not any(one < 1e-5 for one in p)


def test_with_noise_larger_than_stated_sound_placements_are_not_asked_about() -> None:
    louder = RIG.noise.model_copy(update={"spot_sd_px": 0.2, "speckle_sd_px": 0.15})
    for seed in range(3):
        observations = World(RIG.model_copy(update={"noise": louder}), seed).observations(ORDER, 5)
        for n in range(4, 12):
            found = latest_standoff(RIG, until(observations, n), f"{ORDER[n - 1]:g}", len(ORDER))
            assert found is not None
            assert not found.contradicts


def test_without_three_earlier_placements_there_is_no_prediction() -> None:
    assert compared(1, 3, BLUNDER_MM) is None
    observations = World(RIG, 1).observations(ORDER, 5)
    assert latest_standoff(RIG, observations, "777", len(ORDER)) is None
