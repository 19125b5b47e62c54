"""Errors of single ranges, with their sensitivities to calibration, spots and the target's tilt."""

from __future__ import annotations

from math import hypot, radians, sqrt, tan

import numpy as np
import pytest

from tests.support.rangers import IDS, X_MM, positions, thesis_ranger
from tests.support.rigs import thesis_rig
from workbench.model.event import ReadingTaken
from workbench.model.rig import BenchSpec
from workbench.model.target import Placement
from workbench.ranging.ranger import Reading
from workbench.sensor.calibrated import CalibratedSensor
from workbench.trials.accuracy.ranges import CLOSEST, MEAN, range_errors
from workbench.trials.readings import reading_taken
from workbench.trials.reference import Reference

STANDOFF_MM = 500.0


def read(ranges_mm: dict[str, float]) -> Reading:
    px = positions(thesis_ranger(), ranges_mm)
    return thesis_ranger().read_known("s", len(IDS), list(ranges_mm), px, np.full((len(px), 2), 0.03))


def taken_at(standoff_mm: float, reading: Reading) -> ReadingTaken:
    placement = Placement(key="t/1", standoff_mm=standoff_mm)
    return reading_taken(thesis_rig(), thesis_ranger().sensor, "t", placement, 0, reading)


def errors(ranges_mm: dict[str, float], reference: Reference) -> dict[str, float]:
    reading = read(ranges_mm)
    taken = taken_at(reference.standoff_mm, reading)
    found = range_errors(thesis_ranger().sensor, reading, taken, reference)
    return {name: one.error_mm for name, one in found.items()}


def test_each_range_has_an_error_of_its_own() -> None:
    ranges_mm = {i: STANDOFF_MM + n for n, i in enumerate(IDS)}
    found = errors(ranges_mm, Reference(STANDOFF_MM, 0.3))
    assert [found[i] for i in IDS] == pytest.approx([0.0, 1.0, 2.0, 3.0], abs=1e-6)
    assert 0.0 < found[MEAN] < 3.0
    assert set(found) == {CLOSEST, MEAN, *IDS}


def test_a_measured_tilt_of_the_rail_is_no_error() -> None:
    """The lasers are some 0.1 mm beside their design, and parallel to the axis to 5 mrad."""
    bench = BenchSpec(target_yaw_deg=2.0, target_tilt_sd_deg=0.0)
    reference = Reference.of(bench, Placement(key="t/1", standoff_mm=STANDOFF_MM))
    ranges_mm = {i: STANDOFF_MM + tan(radians(2.0)) * x for i, x in zip(IDS, X_MM, strict=True)}
    found = errors(ranges_mm, reference)
    assert [abs(found[i]) for i in IDS] == pytest.approx([0.0] * 4, abs=0.3)
    assert found[CLOSEST] == pytest.approx(0.0, abs=0.3)
    assert abs(errors(ranges_mm, Reference(STANDOFF_MM, 0.3))["L1"]) == pytest.approx(2.1, abs=0.3)


def test_sensitivities_are_the_derivatives_of_the_ranges() -> None:
    """By the finite change of a range where one parameter of the calibration is changed."""
    sensor = thesis_ranger().sensor
    reading = read(dict.fromkeys(IDS, STANDOFF_MM))
    taken = taken_at(STANDOFF_MM, reading)
    found = range_errors(sensor, reading, taken, Reference(STANDOFF_MM, 0.3))
    names = sensor.calibration.laser_ranger.parameters.names
    name, step = "L2.tx", 1e-6
    changed = CalibratedSensor(sensor.calibration, {name: sensor.calibration.geometry()[name] + step})
    px = positions(thesis_ranger(), dict.fromkeys(IDS, STANDOFF_MM))
    after = changed.ranges(IDS, px, np.full((4, 2), 0.03)).range_mm[1]
    expected = (after - STANDOFF_MM) / step
    assert found["L2"].sensitivities.by_parameter[names.index(name)] == pytest.approx(expected, rel=1e-3)


def test_the_choice_between_shapes_completes_the_stated_uncertainty_of_the_closest_range() -> None:
    sensor = thesis_ranger().sensor
    reading = read({i: STANDOFF_MM + 0.5 * n for n, i in enumerate(IDS)})
    found = range_errors(sensor, reading, taken_at(STANDOFF_MM, reading), Reference(STANDOFF_MM, 0.3))
    closest = found[CLOSEST].sensitivities
    assert closest.shape_sd_mm > 0
    by_parameter = closest.by_parameter
    variance = by_parameter @ sensor.covariance @ by_parameter + closest.spot_sd_mm**2
    assert hypot(sqrt(variance), closest.shape_sd_mm) == pytest.approx(reading.sigma_mm, rel=0.05)
    assert [found[name].sensitivities.shape_sd_mm for name in (MEAN, *IDS)] == [0.0] * 5


def test_a_reading_without_a_range_has_no_error() -> None:
    reading = Reading("s", "no_points")
    taken = taken_at(STANDOFF_MM, reading)
    assert range_errors(thesis_ranger().sensor, reading, taken, Reference(STANDOFF_MM, 0.3)) == {}
