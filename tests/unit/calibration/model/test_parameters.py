"""Parameters of a calibration: order, units and priors."""

from __future__ import annotations

from math import radians

import numpy as np
import pytest

from tests.support.rigs import fisheye_rig, thesis_rig
from workbench.calibration.model.parameters import (
    ParameterTable,
    board_parameters,
    placement_parameters,
    sensor_parameters,
    unit_of,
)
from workbench.model.nested import fix_parameters


def test_sensor_parameters_are_lens_reference_and_rays_in_the_rig_s_order() -> None:
    names = [p.name for p in sensor_parameters(thesis_rig())]
    rays = [f"L{i}.{name}" for i in (1, 2, 3, 4) for name in ("x_mm", "y_mm", "tx", "ty")]
    lens = ["f_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3"]
    tilt, drift = ("target_slope_x", "target_slope_y"), ("drift_u_px", "drift_v_px")
    reference = ["offset_mm", "ruler_scale", *tilt, *drift]
    assert names == [*lens, *reference, *rays]
    fisheye = [p.name for p in sensor_parameters(fisheye_rig())]
    assert fisheye[:13] == ["f_px", "cx_px", "cy_px", "k1", "k2", "k3", "k4", *reference]


def test_priors_are_those_of_the_rig_file() -> None:
    table = ParameterTable(sensor_parameters(thesis_rig()))
    by_name = {p.name: (p.prior.value, p.prior.sd) for p in table.parameters}
    assert by_name["f_px"] == (533.3, 26.7)
    assert by_name["L1.x_mm"] == (-60.0, 0.2)
    assert by_name["offset_mm"] == (0.0, 5.0)
    assert by_name["p1"][1] == 0.0
    assert by_name["target_slope_y"] == (0.0, radians(0.5))
    assert by_name["drift_u_px"] == (0.0, 0.0)


def test_a_placement_has_an_error_and_two_slopes_and_belongs_to_no_sensor() -> None:
    rig = thesis_rig()
    found = placement_parameters(rig, ["A", "B"])
    assert [p.name for p in found] == [
        f"{key}.{name}" for key in "AB" for name in ("error_mm", "slope_x", "slope_y")
    ]
    assert {p.kind for p in found} == {"placement"}
    assert [p.prior.sd for p in found[:3]] == pytest.approx([0.3, radians(0.5), radians(0.5)])
    assert {p.prior.value for p in found} == {0.0}


def test_a_board_s_sag_is_as_large_as_the_rig_says_that_it_is_flat() -> None:
    rig = thesis_rig()
    bench = rig.bench.model_copy(update={"board_flatness_sd_mm": 0.07})
    found = board_parameters(rig.model_copy(update={"bench": bench}))
    assert [p.prior.sd for p in found] == [0.07] * 3
    assert {p.unit for p in found} == {"mm"}


@pytest.mark.parametrize(
    ("name", "unit"),
    [("cx_px", "px"), ("L1.x_mm", "mm"), ("P1.board_roll_rad", "rad"), ("L1.tx", "1"), ("k1", "1")],
)
def test_the_unit_is_the_name_s_suffix(name: str, unit: str) -> None:
    assert unit_of(name) == unit


def test_a_constant_is_not_free() -> None:
    rig = fix_parameters(thesis_rig(), ("k2", "L3.tx"))
    parameters = (*sensor_parameters(rig), *placement_parameters(rig, ["A"]))
    table = ParameterTable(parameters)
    constants = {p.name for i, p in enumerate(parameters) if i not in table.free}
    assert constants == {"k2", "p1", "p2", "k3", "L3.tx", "drift_u_px", "drift_v_px"}
    assert table.is_sensor.sum() == len(parameters) - 3
    np.testing.assert_array_equal(table.prior_sd[table.free] > 0, True)
