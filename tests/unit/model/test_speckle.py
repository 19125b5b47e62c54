"""Deviation of a centre by speckle from data sheets."""

from __future__ import annotations

from math import pi

import pytest

from workbench.model.rig import load_rig
from workbench.model.speckle import speckle_sd_px


@pytest.mark.parametrize(("nm", "f_number", "um"), [(650, 2, 7.5), (520, 4, 3), (850, 1.4, 10)])
def test_formula_of_the_rig_format(nm: float, f_number: float, um: float) -> None:
    assert speckle_sd_px(nm, f_number, um) == pytest.approx(
        0.67 * nm * 1e-3 * f_number / (pi * um), rel=1e-12
    )


def test_thesis_rig_states_this_value() -> None:
    from tests.crash.short import ROOT

    stated = load_rig(ROOT / "rigs/thesis-emulated.yaml").noise.speckle_sd_px
    assert speckle_sd_px(650, 2, 7.5) == pytest.approx(stated, abs=5e-4)
