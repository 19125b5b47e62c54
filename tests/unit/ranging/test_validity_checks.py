"""Spots that cannot give a range, and ranges outside the calibrated ones."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.rangers import IDS, spots
from workbench.model.calibration import Validity
from workbench.model.event import LaserRange
from workbench.ranging.ranger import Ranger
from workbench.ranging.validity_checks import failed_checks, outside_validity
from workbench.sensor.calibrated import CalibratedSensor
from workbench.sensor.range_model import RangeEstimates


@pytest.mark.parametrize(
    ("u_px", "v_px", "why"),
    [
        (300.0, -5.0, "outside the image"),
        (300.0, 481.0, "outside the image"),
        (645.0, 240.0, "outside the image"),
        (300.0, 300.0, "from the laser's line"),
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
    (why,) = failed_checks(beyond, ranges, ranger.size_px)
    assert why is not None
    assert "fold of the lens model" in why


def test_a_spot_all_but_at_infinity_has_no_range(ranger: Ranger) -> None:
    spot = ranger.sensor.spot_px("L4", np.array([3e6]))
    reading = ranger.read_known("s", 1, ["L4"], spot, np.full((1, 2), 0.05))
    assert reading.status == "no_points"
    assert "1 sigma" in reading.notes[0] or "vanishing point" in reading.notes[0]


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


@pytest.mark.parametrize(
    ("u_px", "range_mm", "sigma_mm", "misfit_sd", "good"),
    [
        (300.0, 500.0, 1.0, 0.0, True),
        (300.0, 500.0, 249.0, 5.9, True),
        (300.0, 500.0, 251.0, 0.0, False),
        (300.0, 500.0, 1.0, 6.1, False),
        (300.0, np.inf, 1.0, 0.0, False),
        (300.0, np.nan, np.nan, np.nan, False),
        (300.0, -5.0, 1.0, 0.0, False),
        (-0.4, 500.0, 1.0, 0.0, True),
        (-0.6, 500.0, 1.0, 0.0, False),
        (639.4, 500.0, 1.0, 0.0, True),
        (639.6, 500.0, 1.0, 0.0, False),
    ],
)
def test_limits_of_what_gives_a_range(
    u_px: float, range_mm: float, sigma_mm: float, misfit_sd: float, good: bool
) -> None:
    sigma = np.full(1, sigma_mm)
    ranges = RangeEstimates(np.full(1, range_mm), sigma, np.zeros((1, 1)), np.eye(1), np.full(1, misfit_sd))
    (why,) = failed_checks(np.array([[u_px, 240.0]]), ranges, (640, 480))
    assert (why is None) == good


def test_a_spot_of_one_coordinate_is_inside_by_that_one() -> None:
    ranges = RangeEstimates(np.full(2, 500.0), np.ones(2), np.zeros((2, 1)), np.eye(1), np.zeros(2))
    why = failed_checks(np.array([[300.0, np.nan], [700.0, np.nan]]), ranges, (640, 480))
    assert why[0] is None
    assert why[1] is not None


@pytest.mark.parametrize(
    ("range_mm", "u_px", "beyond_px"),
    [(600.0, 150.0, None), (400.0, 98.0, 2.0), (1100.0, 203.0, 3.0), (1100.0, 200.4, 0.0)],
)
def test_only_ranges_outside_the_calibrated_ones_are_remarked_with_how_far_the_spot_lies_outside(
    range_mm: float, u_px: float, beyond_px: float | None
) -> None:
    """The spot moves from u = 100 at 500 mm to u = 200 at 1000 mm; less than half a pixel is not told."""
    validity = Validity(standoff_mm=(500.0, 1000.0), max_relative_range_sd=0.01)
    field = {"L1": np.array([[100.0, 240.0], [200.0, 240.0]])}
    laser = LaserRange(laser_id="L1", range_mm=range_mm, sigma_mm=1.0, u_px=u_px, v_px=240.0)
    remarks = outside_validity([laser], validity, field)
    assert len(remarks) == (beyond_px is not None)
    if remarks:
        assert f"L1: {range_mm:.0f} mm" in remarks[0]
        assert (f"{beyond_px:.1f} px" in remarks[0]) == bool(beyond_px)
