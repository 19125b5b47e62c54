"""Spots that cannot give a range, and ranges outside the calibrated ones."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.rangers import IDS, spots
from workbench.ranging.ranger import Ranger
from workbench.ranging.validity_checks import objections
from workbench.sensor.calibrated import CalibratedSensor


@pytest.mark.parametrize(
    ("u_px", "v_px", "why"),
    [
        (300.0, -5.0, "outside the picture"),
        (300.0, 481.0, "outside the picture"),
        (645.0, 240.0, "outside the picture"),
        (300.0, 300.0, "off the laser's line"),
    ],
)
def test_a_spot_that_cannot_be_the_laser_s_has_no_range(
    ranger: Ranger, u_px: float, v_px: float, why: str
) -> None:
    reading = ranger.read_known("s", 1, ["L1"], np.array([[u_px, v_px]]), np.full((1, 2), 0.05))
    assert (reading.status, reading.closest_mm, reading.lasers) == ("no_points", None, ())
    assert reading.notes[0].startswith("L1: ")
    assert why in reading.notes[0]


def test_a_spot_where_the_lens_model_folds_over_has_no_range(ranger: Ranger) -> None:
    folding = CalibratedSensor(ranger.calibration, {"k1": -0.45, "k2": 0.0, "k3": 0.0})
    (far,) = folding.spot_px("L4", np.array([np.inf]))
    beyond = np.array([[20.0, far[1]]])
    ranges = folding.ranges(["L1"], beyond, np.full((1, 2), 0.05))
    (why,) = objections(beyond, ranges, ranger.size_px)
    assert why is not None
    assert "folds over" in why


def test_a_spot_all_but_at_infinity_has_no_range(ranger: Ranger) -> None:
    spot = ranger.sensor.spot_px("L4", np.array([3e6]))
    reading = ranger.read_known("s", 1, ["L4"], spot, np.full((1, 2), 0.05))
    assert reading.status == "no_points"
    assert "mm only" in reading.notes[0] or "infinity" in reading.notes[0]


def test_a_range_beyond_the_calibrated_ones_is_marked(ranger: Ranger) -> None:
    reading = ranger.read_lit("s", spots(ranger, dict.fromkeys(IDS, 4600.0)))
    assert reading.status == "done"
    assert reading.notes[0] == "L1: 4600 mm lies outside the calibrated 125 to 4500 mm"
    assert ranger.read_lit("s", spots(ranger, dict.fromkeys(IDS, 4400.0))).notes == ()
    near = ranger.read_lit("s", spots(ranger, dict.fromkeys(IDS, 4500.2)))
    assert near.notes[0] == "L1: 4500.2 mm lies outside the calibrated 125 to 4500 mm"


@pytest.mark.parametrize(("range_mm", "end_mm"), [(7000.0, 4500.0), (110.0, 125.0)])
def test_how_far_a_spot_lies_outside_the_calibrated_field_is_told(
    ranger: Ranger, range_mm: float, end_mm: float
) -> None:
    lit = ("L2", "L3") if range_mm < end_mm else IDS  # the outer spots leave the picture
    reading = ranger.read_lit("s", spots(ranger, dict.fromkeys(lit, range_mm)))
    outside = [note for note in reading.notes if "calibrated field" in note]
    assert len(reading.notes) - len(outside) == len(IDS) - len(lit)
    for laser_id, note in zip(lit, outside, strict=True):
        seen, end = ranger.sensor.spot_px(laser_id, np.array([range_mm, end_mm]))
        assert note.endswith(f", its spot {np.hypot(*(seen - end)):.1f} px outside the calibrated field")


def test_a_calibration_of_one_standoff_tells_how_far_its_spot_is(ranger: Ranger) -> None:
    part = ranger.calibration.laser_ranger
    one = part.validity.model_copy(update={"standoff_mm": (500.0, 500.0)})
    only = ranger.calibration.model_copy(update={"laser_ranger": part.model_copy(update={"validity": one})})
    reading = Ranger(only).read_lit("s", spots(ranger, dict.fromkeys(IDS, 800.0)))
    seen, there = ranger.sensor.spot_px("L1", np.array([800.0, 500.0]))
    assert f"its spot {np.hypot(*(seen - there)):.1f} px outside" in reading.notes[0]
