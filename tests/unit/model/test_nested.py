"""Rigs with parameters held constant."""

from __future__ import annotations

from math import radians, tan

import pytest

from tests.support.rigs import thesis_rig
from workbench.model.errors import BadInputError
from workbench.model.nested import fix_parameters


def test_parameters_become_constants_and_nothing_else_changes() -> None:
    rig = thesis_rig()
    held = fix_parameters(rig, ["k2", "offset_mm", "L2.tx"])
    assert (held.camera.k2.sd, held.bench.offset_mm.sd, held.lasers[1].tx.sd) == (0.0, 0.0, 0.0)
    assert (held.camera.k1, held.bench.ruler_scale) == (rig.camera.k1, rig.bench.ruler_scale)
    assert (held.lasers[0], held.lasers[2:]) == (rig.lasers[0], rig.lasers[2:])
    assert held.lasers[1].x_mm == rig.lasers[1].x_mm


@pytest.mark.parametrize("name", ["target_slope_x", "target_slope_y"])
def test_the_common_tilt_is_held_about_both_axes_and_no_placement_s_own(name: str) -> None:
    bench = thesis_rig().bench.model_copy(update={"target_yaw_deg": 3.0})
    held = fix_parameters(thesis_rig().model_copy(update={"bench": bench}), [name]).bench
    assert (held.target_slope_x.sd, held.target_slope_y.sd) == (0.0, 0.0)
    assert held.target_slope_x.value == pytest.approx(tan(radians(3.0)))
    assert held.tilt_sd_deg == bench.tilt_sd_deg > 0


@pytest.mark.parametrize("name", ["k9", "L9.tx", "L1.colour", "placement_sd_mm", ""])
def test_a_parameter_that_is_none(name: str) -> None:
    with pytest.raises(BadInputError, match=r"expected one of f_px, .*offset_mm, .*L4\.ty"):
        fix_parameters(thesis_rig(), [name])
