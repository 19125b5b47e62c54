"""Map of spots that will be lost."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.exact import calibration_of
from tests.support.four_lasers import four_laser_rig
from workbench.model.target import CylinderTarget, FlatTarget, NoTarget, Placement, TargetShape
from workbench.sensor.calibrated import CalibratedSensor
from workbench.trials.spot_map import SpotMap

RIG = four_laser_rig()
RIG = RIG.model_copy(update={"bench": RIG.bench.model_copy(update={"reach_mm": (40.0, 5000.0)})})
CALIBRATION = calibration_of(RIG)
MAPS = (SpotMap.of_calibration(CALIBRATION, RIG), SpotMap.of_rig(RIG))


def at(standoff_mm: float, target: TargetShape | None = None) -> Placement:
    return Placement(key="k", standoff_mm=standoff_mm, target=target or FlatTarget())


@pytest.mark.parametrize("spots", MAPS)
def test_a_spot_that_leaves_the_image_is_named(spots: SpotMap) -> None:
    """533.3 px x 60 mm / 100 mm = 320 px: the outer spots lie at the edge of 640 pixels at 100 mm."""
    assert spots.lost(at(101.0)) == {}
    near = spots.lost(at(99.0))
    assert list(near) == ["L1", "L4"]
    assert set(near.values()) == {"outside the image"}


def test_positions_are_those_of_the_calibrated_sensor() -> None:
    sensor, (spots, _) = CalibratedSensor(CALIBRATION), MAPS
    ranges = np.array([150.0, 300.0, 700.0, 2000.0])
    expected = [sensor.spot_px(i, np.array([mm]))[0] for i, mm in zip(sensor.ids, ranges, strict=True)]
    assert spots._spots_px(ranges) == pytest.approx(np.array(expected))


@pytest.mark.parametrize(
    ("diameter_mm", "lost"),
    [
        (178.0, {}),
        (110.0, {"L1": "off the target", "L4": "off the target"}),
        (122.0, {"L1": "grazes the target", "L4": "grazes the target"}),
    ],
)
def test_a_beam_beside_a_cylinder_misses_it(diameter_mm: float, lost: dict[str, str]) -> None:
    assert MAPS[0].lost(at(400.0, CylinderTarget(diameter_mm=diameter_mm))) == lost


def test_a_turned_target_is_nearer_on_one_side() -> None:
    """On a plane at 150 mm, turned by 60 degrees, the beam at +60 mm ends at 46 mm, at -60 mm at 254 mm."""
    lost = MAPS[0].lost(at(150.0, FlatTarget(yaw_deg=-60.0)))
    assert lost["L4"] == "outside the image"
    assert "L1" not in lost


def test_beyond_the_reach_spots_are_too_dim_or_saturated() -> None:
    far = MAPS[0].lost(at(RIG.bench.reach_mm[1] + 1.0))
    assert len(far) == 4
    assert all("dim" in cause for cause in far.values())
    bench = RIG.bench.model_copy(update={"reach_mm": (500.0, 5000.0)})
    near = SpotMap.of_rig(RIG.model_copy(update={"bench": bench})).lost(at(400.0))
    assert all("saturated" in cause for cause in near.values())
    assert len(near) == 4


def test_spots_merge_far_away() -> None:
    """533.3 px x 30 mm / 4000 mm = 4 px between L1 and L2."""
    assert MAPS[0].merged(at(1000.0)) == []
    assert MAPS[0].merged(at(4000.0)) == [("L1", "L2"), ("L3", "L4")]


def test_without_a_target_the_map_is_that_of_the_standoff() -> None:
    assert MAPS[0].lost(at(400.0, NoTarget())) == {}
