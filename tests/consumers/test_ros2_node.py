"""Values of ROS messages from lines of `workbench range --json`; this part of the example needs no ROS."""

from __future__ import annotations

import importlib.util
import json
import sys
from math import atan2, hypot, inf, isnan, radians, tan
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import yaml

from tests.support.command_line import SCRIPT, shell
from tests.support.reference_session import REFERENCE

EXAMPLE = Path(__file__).parents[2] / "examples/ros2_node/laser_range_node/messages.py"
CALIBRATION = REFERENCE / "calibration.yaml"
LASERS = {
    "L1": {"axis": "u", "origin_mm": [-60.0, 0.0, 0.0], "direction": [0.01, 0.0, 1.0]},
    "L2": {"axis": "u", "origin_mm": [60.0, 0.0, 0.0], "direction": [0.0, 0.0, 1.0]},
    "L3": {"axis": "v", "origin_mm": [0.0, 60.0, 0.0], "direction": [0.0, 0.0, 1.0]},
}


@pytest.fixture(scope="module")
def messages() -> ModuleType:
    spec = importlib.util.spec_from_file_location("laser_range_messages", EXAMPLE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


def calibration() -> dict[str, Any]:
    ranger = {
        "lasers": [{"id": name, **laser} for name, laser in LASERS.items()],
        "reference_plane": {"offset_mm": -10.0},
        "validity": {"standoff_mm": [100.0, 4000.0]},
    }
    return {"laser_ranger": ranger}


def reading(closest_mm: float | None, status: str = "done", **range_mm: float | None) -> dict[str, Any]:
    lasers = [{"id": name, "range_mm": value} for name, value in range_mm.items()]
    sigma_mm = None if closest_mm is None else 2.0
    return {"status": status, "closest_mm": closest_mm, "sigma_mm": sigma_mm, "lasers": lasers}


def test_the_closest_range_is_in_metres_with_its_variance(messages: ModuleType) -> None:
    values = messages.range_values(reading(500.0), messages.geometry_of(calibration()))

    assert (values.range, values.min_range, values.max_range) == pytest.approx((0.5, 0.1, 4.0))
    assert values.variance == pytest.approx(4e-6)
    assert tan(values.field_of_view / 2) == pytest.approx(0.6)  # 60 mm beside the axis at 100 mm


def test_no_spot_is_infinite_and_a_failed_reading_is_not_a_number(messages: ModuleType) -> None:
    geometry = messages.geometry_of(calibration())

    assert messages.range_values(reading(None, "no_points"), geometry).range == inf
    assert isnan(messages.range_values(reading(None, "not_enough_points"), geometry).range)


def test_points_lie_on_their_rays_to_the_left_of_the_axis(messages: ModuleType) -> None:
    """The camera's x points right: a laser at -60 mm is on the left. Depth is 10 mm less than the range."""
    points = messages.points_m(
        reading(500.0, L1=1000.0, L2=500.0, L3=500.0), messages.geometry_of(calibration())
    )

    assert len(points) == 2
    assert points[0] == pytest.approx((1.0, 0.06 - 0.01 * 0.99))
    assert points[1] == pytest.approx((0.5, -0.06))


def test_a_scan_has_each_point_in_its_direction_and_nothing_elsewhere(messages: ModuleType) -> None:
    geometry = messages.geometry_of(calibration())
    scan = messages.scan_values(reading(500.0, L1=1000.0, L2=500.0), geometry)

    filled = {n: distance for n, distance in enumerate(scan.ranges) if not isnan(distance)}
    for forward, left in ((1.0, 0.0501), (0.5, -0.06)):
        n = min(filled, key=lambda n: abs(scan.angle_min + n * scan.angle_increment - atan2(left, forward)))
        angle = scan.angle_min + n * scan.angle_increment
        assert abs(angle - atan2(left, forward)) <= 0.5 * scan.angle_increment + 1e-12
        assert filled[n] == pytest.approx(hypot(forward, left))
    assert len(filled) == 2
    assert scan.angle_min + 180 * scan.angle_increment == pytest.approx(scan.angle_max)


def test_of_two_points_in_one_direction_the_nearer_remains(messages: ModuleType) -> None:
    geometry = messages.geometry_of(calibration())
    scan = messages.scan_values(reading(500.0, L1=3000.0, L2=3000.0), geometry, radians(45), 3)

    assert [n for n, one in enumerate(scan.ranges) if not isnan(one)] == [1]
    assert scan.ranges[1] == pytest.approx(hypot(3.0, 0.06 - 0.01 * 2.99))


def test_a_laser_without_a_range_is_no_point(messages: ModuleType) -> None:
    assert messages.points_m(reading(None, L1=None), messages.geometry_of(calibration())) == []


def test_lines_of_the_command_are_readings(messages: ModuleType) -> None:
    """A real calibration and the real command's lines; the target of the session is a flat."""
    geometry = messages.geometry_of(yaml.safe_load(CALIBRATION.read_text()))
    ended = shell(f"{SCRIPT} range {REFERENCE}/trial-captures.csv --calibration {CALIBRATION} --json")

    assert ended.returncode == 0, ended.stderr
    readings = [json.loads(line) for line in ended.stdout.splitlines()]
    assert len(readings) >= 6
    for one in readings:
        standoff_m = 1e-3 * float(one["scene"].split("/")[1].removesuffix("mm"))
        assert messages.range_values(one, geometry).range == pytest.approx(standoff_m, rel=0.02)
        seen = [d for d in messages.scan_values(one, geometry).ranges if not isnan(d)]
        beside_m = min(abs(ray[0]) for ray in geometry.rays.values())
        assert min(seen) == pytest.approx(hypot(standoff_m, beside_m), rel=0.03)
