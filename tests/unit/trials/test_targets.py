"""Targets of trials: placements, true values, and targets that the lasers cannot see."""

from __future__ import annotations

from math import cos, hypot, radians, sqrt, tan

import numpy as np
import pytest

from tests.support.exact import calibration_of
from tests.support.four_lasers import four_laser_rig
from tests.support.running import two_laser_rig
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig
from workbench.model.target import CylinderTarget, FlatTarget
from workbench.sensor.calibrated import CalibratedSensor
from workbench.trials.targets import (
    STEEPEST_ON_CYLINDER,
    CylinderSpec,
    FlatTargetSpec,
    InclineSpec,
    front_angle_deg,
    target_placement,
    true_values,
)

RULER_STEP_MM = 0.1
RIG = four_laser_rig()
SENSOR = CalibratedSensor(calibration_of(RIG))


@pytest.mark.parametrize("angle_deg", [-60.0, 5.0, 30.0])
def test_the_near_end_of_an_incline_is_at_the_range_asked_for(angle_deg: float) -> None:
    spec = InclineSpec(kind="incline", angle_deg=angle_deg, reference_sd_deg=0.2, reference_sd_mm=0.4)
    rig = RIG.model_copy(update={"bench": RIG.bench.model_copy(update={"target_tilt_sd_deg": 0.15})})
    placed = target_placement(spec, "k", 300.0, rig)
    assert isinstance(placed.target, FlatTarget)
    ends = [placed.standoff_mm + tan(radians(placed.target.yaw_deg)) * x for x in (-60.0, 60.0)]
    assert min(ends) == pytest.approx(300.0, abs=RULER_STEP_MM / 2)
    assert placed.standoff_mm == pytest.approx(round(placed.standoff_mm, 1))
    true = true_values(spec, placed, SENSOR, rig)
    assert (true.angle_deg, true.set_deg, true.angle_sd_deg) == pytest.approx((angle_deg, angle_deg, 0.25))
    assert true.range_mm == pytest.approx(min(ends))
    lead_sd_mm = 60.0 / cos(radians(angle_deg)) ** 2 * radians(0.25)
    assert true.range_sd_mm == pytest.approx(hypot(0.4, lead_sd_mm))


def test_the_angle_of_an_incline_has_the_uncertainty_of_the_common_tilt() -> None:
    bench = RIG.bench.model_copy(update={"target_tilt_sd_deg": 0.5})
    rig = RIG.model_copy(update={"bench": bench})
    spec = InclineSpec(kind="incline", angle_deg=30.0, reference_sd_deg=0.2, reference_sd_mm=0.0)
    true = true_values(spec, target_placement(spec, "k", 300.0, rig), SENSOR, rig)
    angle_deg = 30.0 + hypot(0.2, 0.5) * np.random.default_rng(6).standard_normal(20_000)
    # The relative standard deviation of a variance of 20 000 trials is 1 %.
    assert true.angle_sd_deg is not None
    assert true.angle_sd_deg**2 == pytest.approx(angle_deg.var(), rel=0.05)
    assert true.range_sd_mm**2 == pytest.approx((60.0 * np.tan(np.radians(angle_deg))).var(), rel=0.05)


def tilted_rig(yaw_deg: float) -> Rig:
    return RIG.model_copy(update={"bench": RIG.bench.model_copy(update={"target_yaw_deg": yaw_deg})})


@pytest.mark.parametrize("yaw_deg", [-2.0, 1.5])
def test_a_measured_common_tilt_adds_to_the_set_angle(yaw_deg: float) -> None:
    spec, rig = InclineSpec(kind="incline", angle_deg=30.0), tilted_rig(yaw_deg)
    placed = target_placement(spec, "k", 300.0, rig)
    true = true_values(spec, placed, SENSOR, rig)
    assert (true.angle_deg, true.set_deg) == pytest.approx((30.0 + yaw_deg, 30.0))
    near_mm = placed.standoff_mm - 60.0 * tan(radians(30.0 + yaw_deg))
    assert true.range_mm == pytest.approx(near_mm)
    assert true.range_mm == pytest.approx(300.0, abs=RULER_STEP_MM / 2)


@pytest.mark.parametrize("yaw_deg", [-2.0, 0.0, 1.5])
def test_a_measured_common_tilt_brings_an_end_of_a_flat_target_nearer(yaw_deg: float) -> None:
    spec, rig = FlatTargetSpec(), tilted_rig(yaw_deg)
    true = true_values(spec, target_placement(spec, "k", 300.0, rig), SENSOR, rig)
    assert true.range_mm == pytest.approx(300.0 - 60.0 * tan(radians(abs(yaw_deg))))


def test_an_incline_about_the_horizontal_axis_needs_lasers_above_each_other() -> None:
    spec = InclineSpec(kind="incline", angle_deg=30.0, axis="horizontal")
    assert front_angle_deg(spec) == 90
    with pytest.raises(BadInputError, match="horizontal") as caught:
        target_placement(spec, "k", 300.0, RIG)
    assert caught.value.exit_code == 2


@pytest.mark.parametrize(
    ("shift_mm", "recess_mm"), [(0.0, 0.0), (50.0, 0.0), (80.0, 200 - sqrt(200**2 - 20**2))]
)
def test_the_closest_point_of_a_cylinder_lies_over_the_front(shift_mm: float, recess_mm: float) -> None:
    spec = CylinderSpec(kind="cylinder", diameter_mm=400.0, shift_mm=shift_mm, diameter_sd_mm=0.2)
    placed = target_placement(spec, "k", 400.0, RIG)
    assert isinstance(placed.target, CylinderTarget)
    assert placed.standoff_mm == round(400.0 - recess_mm, 1)
    true = true_values(spec, placed, SENSOR, RIG)
    assert (true.radius_mm, true.radius_sd_mm) == pytest.approx((200.0, 0.1))
    assert true.range_mm == pytest.approx(placed.standoff_mm + recess_mm)


@pytest.mark.parametrize(("factor", "seen"), [(0.999, False), (1.001, True)])
def test_three_beams_must_hit_a_cylinder(factor: float, seen: bool) -> None:
    smallest_mm = 2 * 60.0 / STEEPEST_ON_CYLINDER
    spec = CylinderSpec(kind="cylinder", diameter_mm=factor * smallest_mm)
    if seen:
        target_placement(spec, "k", 400.0, RIG)
        return
    with pytest.raises(BadInputError, match=f"{smallest_mm:.4g} mm.*{spec.diameter_mm:g}") as caught:
        target_placement(spec, "k", 400.0, RIG)
    assert caught.value.exit_code == 2


def test_two_lasers_measure_no_cylinder() -> None:
    with pytest.raises(BadInputError):
        target_placement(CylinderSpec(kind="cylinder", diameter_mm=500.0), "k", 400.0, two_laser_rig())


def test_the_near_end_of_a_flat_target_is_closer_by_its_squareness() -> None:
    bench = RIG.bench.model_copy(
        update={"tilt_sd_deg": 0.3, "target_tilt_sd_deg": 0.4, "placement_sd_mm": 0.2}
    )
    rig = RIG.model_copy(update={"bench": bench})
    spec = FlatTargetSpec()
    true = true_values(spec, target_placement(spec, "k", 400.0, rig), SENSOR, rig)
    random = np.random.default_rng(5)
    tilt = np.radians(0.5) * random.standard_normal(20_000)
    ends_mm = 0.2 * random.standard_normal(20_000) - 60.0 * np.abs(np.tan(tilt))
    # The relative standard deviation of a variance of 20 000 trials is 1 %.
    scale_mm = rig.bench.ruler_scale.sd * 400.0
    assert true.range_sd_mm**2 == pytest.approx(ends_mm.var() + scale_mm**2, rel=0.07)
    assert true.range_mm == pytest.approx(400.0 + ends_mm.mean(), abs=0.02)
