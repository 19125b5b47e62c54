"""Rigs that know one parameter otherwise."""

from __future__ import annotations

from pathlib import Path

import pytest

import workbench as wb

ROOT = Path(__file__).parents[3]
RIG = ROOT / "rigs/thesis-emulated.yaml"


def test_value_and_deviation_change_and_nothing_else() -> None:
    rig = wb.with_prior(RIG, "L2.x_mm")
    changed = wb.with_prior(rig, "L2.x_mm", value=-31.0, sd=0.02)
    assert (changed.lasers[1].x_mm.value, changed.lasers[1].x_mm.sd) == (-31.0, 0.02)
    assert wb.with_prior(changed, "L2.x_mm", value=-30.0, sd=0.2) == rig


@pytest.mark.parametrize("name", ["f_px", "offset_mm", "L1.tx"])
def test_a_parameter_known_better_is_determined_better(name: str) -> None:
    vague, exact = (
        wb.design(wb.with_prior(RIG, name, sd=sd), standoffs=[200, 1000, 4000]).parameters["sd"][name]
        for sd in (0.5, 1e-4)
    )
    assert exact < vague


@pytest.mark.parametrize(
    ("name", "value", "sd"), [("k9", 0.0, 1.0), ("f_px", None, -1.0), ("L1.tx", 50.0, None)]
)
def test_wrong_parameters_and_numbers_are_refused(name: str, value: float | None, sd: float | None) -> None:
    with pytest.raises(wb.BadInputError):
        wb.with_prior(RIG, name, value, sd)
