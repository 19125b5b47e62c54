"""Design of standoffs by the public interface."""

from __future__ import annotations

from pathlib import Path

import pytest

import workbench as wb
from workbench.calibration.design.forecast import forecast
from workbench.model.rig import load_rig

RIG = Path(__file__).parents[3] / "rigs/thesis-emulated.yaml"


def test_design_has_the_numbers_of_the_forecast() -> None:
    ours = wb.design(RIG, standoffs=[200, 1000, 4000], repeats=5)
    expected = forecast(load_rig(RIG), (200, 1000, 4000), 5)
    assert ours.standoffs_mm == (200, 1000, 4000)
    assert ours.worst_relative_sd == expected.worst_relative_sd
    assert ours.parameters["sd"].tolist() == [p.sd for p in expected.parameters]
    assert len(ours.ranges) == len(expected.ranges)
    assert ours.ranges["relative_sd"].min() > 0


def test_without_standoffs_the_given_number_is_proposed() -> None:
    rig = load_rig(RIG)
    ours = wb.design(rig, count=3)
    nearest, farthest = rig.bench.reach_mm
    assert len(ours.standoffs_mm) == 3
    assert nearest <= min(ours.standoffs_mm) < max(ours.standoffs_mm) <= farthest


def test_a_missing_rig_file_is_refused() -> None:
    with pytest.raises(wb.BadInputError):
        wb.design("no/such/rig.yaml")
