"""Readings of `workbench range --json` as the values of ROS messages. Nothing here needs ROS.

Frame of the messages, after REP 103: origin where the optical axis meets the reference plane; x forward along
the optical axis, y left, z up. Lengths are in metres, angles in radians.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import atan2, floor, hypot, inf, nan, pi
from typing import Any

INFRARED = 1
"""`sensor_msgs/Range.INFRARED`, the kind for light."""
M = 1e-3
"""Metres in a millimetre."""


@dataclass(frozen=True)
class SensorGeometry:
    """The part of a calibration that the messages use."""

    offset_m: float
    """Distance of the pinhole behind the reference plane."""
    rays: Mapping[str, tuple[float, float, float, float]]
    """Of each laser: where it starts, to the left and up, m; its tangents to the left and up."""
    horizontal: frozenset[str]
    """Lasers whose spots lie in one horizontal plane."""
    nearest_m: float
    farthest_m: float


@dataclass(frozen=True)
class RangeValues:
    """Fields of `sensor_msgs/Range`."""

    radiation_type: int
    field_of_view: float
    min_range: float
    max_range: float
    range: float
    """Closest range; infinite where nothing was seen, NaN where a reading failed (REP 117)."""
    variance: float
    """m^2; 0: not known."""


@dataclass(frozen=True)
class ScanValues:
    """Fields of `sensor_msgs/LaserScan`."""

    angle_min: float
    angle_max: float
    angle_increment: float
    range_min: float
    range_max: float
    ranges: tuple[float, ...]
    """Distance from the origin in each direction; NaN where no laser is."""


def geometry_of(calibration: Mapping[str, Any]) -> SensorGeometry:
    """Geometry of a calibration file, read by any YAML parser."""
    ranger = calibration["laser_ranger"]
    rays = {}
    for laser in ranger["lasers"]:
        (x, y, _), (tx, ty, _) = laser["origin_mm"], laser["direction"]
        rays[laser["id"]] = (-x * M, -y * M, -tx, -ty)  # the camera's x points right, its y down
    nearest, farthest = ranger["validity"]["standoff_mm"]
    horizontal = frozenset(laser["id"] for laser in ranger["lasers"] if laser["axis"] == "u")
    offset_m = ranger["reference_plane"]["offset_mm"] * M
    return SensorGeometry(offset_m, rays, horizontal, nearest * M, farthest * M)


def range_values(reading: Mapping[str, Any], geometry: SensorGeometry) -> RangeValues:
    """Closest range of a reading, one line of `workbench range --json`.

    The field of view is the angle of the lasers' front at the nearest range.
    """
    left = [ray[0] + ray[2] * (geometry.nearest_m + geometry.offset_m) for ray in geometry.rays.values()]
    view = 2.0 * max(atan2(abs(at), geometry.nearest_m) for at in left)
    closest, sigma = reading.get("closest_mm"), reading.get("sigma_mm")
    without = inf if reading["status"] == "no_points" else nan
    seen = without if closest is None else closest * M
    variance = 0.0 if sigma is None else (sigma * M) ** 2
    return RangeValues(INFRARED, view, geometry.nearest_m, geometry.farthest_m, seen, variance)


def points_m(reading: Mapping[str, Any], geometry: SensorGeometry) -> list[tuple[float, float]]:
    """Points (forward, left) of the horizontal lasers with a range."""
    points = []
    for laser in reading["lasers"]:
        if laser["id"] in geometry.horizontal and laser["range_mm"] is not None:
            forward = laser["range_mm"] * M
            left, _, tangent, _ = geometry.rays[laser["id"]]
            points.append((forward, left + tangent * (forward + geometry.offset_m)))
    return points


def scan_values(
    reading: Mapping[str, Any], geometry: SensorGeometry, half_angle: float = pi / 4, directions: int = 181
) -> ScanValues:
    """Points of the horizontal lasers as a scan from the origin.

    The beams are parallel, a scan's rays are not: each point goes to its nearest direction, which moves it
    sideways by up to half an increment. Of two points in one direction the nearer remains.
    """
    increment = 2.0 * half_angle / (directions - 1)
    ranges = [nan] * directions
    for forward, left in points_m(reading, geometry):
        n = floor((atan2(left, forward) + half_angle) / increment + 0.5)
        distance = hypot(forward, left)
        if 0 <= n < directions and not distance >= ranges[n]:
            ranges[n] = distance
    return ScanValues(
        -half_angle, half_angle, increment, geometry.nearest_m, 2.0 * geometry.farthest_m, tuple(ranges)
    )
