"""3D view of the bench: camera, laser rays, target and spots, mm in the camera frame."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from math import cos, pi, radians, sin, tan

import numpy as np
import rerun as rr

from workbench.model.event import LaserRange
from workbench.model.rig import CameraSpec
from workbench.model.spot import Spot
from workbench.model.target import (
    BoardTarget,
    CylinderTarget,
    FlatTarget,
    NoTarget,
    Placement,
    PolynomialTarget,
)
from workbench.viewer import entities as at
from workbench.viewer.camera import RERUN_PIXEL_CENTRE
from workbench.viewer.geometry import Geometry
from workbench.viewer.stream import Stream

RAY_LENGTH_MM = 5000.0
TARGET_HALF_MM = 150.0
"""Half side of the drawn target, whose real size is unknown."""
_IMAGE_PLANE_MM = 150.0
_LINE = rr.Radius.ui_points(1.5)
_DOT = rr.Radius.ui_points(5.0)

Point = tuple[float, float, float]


def log_styles(stream: Stream) -> None:
    """Log the orientation of the 3D view, and the step-like curve of the standoff."""
    stream.log(at.BENCH, rr.ViewCoordinates.RDF, static=True)
    stairs = rr.SeriesLines(colors=at.WHITE, names="standoff", interpolation_mode="StepAfter")
    stream.log(at.STANDOFF_SCALAR, stairs, static=True)


def log_sensor(stream: Stream, camera: CameraSpec, geometry: Geometry, colors: Mapping[str, at.Rgb]) -> None:
    """Log camera and laser rays with their present parameters."""
    matrix = geometry.camera_matrix
    matrix[:2, 2] += RERUN_PIXEL_CENTRE
    pinhole = rr.Pinhole(
        image_from_camera=matrix,
        resolution=[camera.width_px, camera.height_px],
        camera_xyz=rr.ViewCoordinates.RDF,
        image_plane_distance=_IMAGE_PLANE_MM,
    )
    stream.log(at.CAMERA, pinhole)
    for laser, color in colors.items():
        ray = [geometry.ray_at(laser, 0.0), geometry.ray_at(laser, RAY_LENGTH_MM)]
        stream.log(at.under(at.RAYS, laser), rr.LineStrips3D([ray], colors=color, radii=_LINE))


def log_target(stream: Stream, placement: Placement, geometry: Geometry) -> None:
    """Log the target at its standoff by the ruler, and clear the points of the previous placement."""
    z_mm = placement.standoff_mm + geometry.offset_mm
    outline = _outline(placement, z_mm)
    stream.log(at.TARGET, rr.LineStrips3D(outline, colors=at.WHITE, radii=_LINE))
    # Below the target: a label of the outline itself would cover the spots in its middle.
    below = [(0.0, TARGET_HALF_MM, z_mm)] if outline else []
    label = rr.Points3D(
        below, labels=[f"target at {placement.standoff_mm:g} mm"] * len(below), colors=at.WHITE
    )
    stream.log(f"{at.TARGET}/label", label)
    stream.log(at.STANDOFF_SCALAR, rr.Scalars(placement.standoff_mm))
    for entity in (at.SPOTS_ON_TARGET, at.RANGED_POINTS):
        stream.log(entity, rr.Clear(recursive=True))


def log_spots_on_target(
    stream: Stream,
    spots: Sequence[Spot],
    placement: Placement,
    geometry: Geometry,
    colors: Mapping[str, at.Rgb],
) -> None:
    """Log spots on a flat target along their lines of sight; distances from rays are calibration errors."""
    if not isinstance(placement.target, FlatTarget | BoardTarget) or not spots:
        return
    pixels = np.array([(spot.u_px, spot.v_px) for spot in spots])
    points = geometry.seen_on(placement.target, placement.standoff_mm, pixels)
    by_laser: dict[str, list[int]] = defaultdict(list)
    for i, spot in enumerate(spots):
        by_laser[spot.laser_id or at.UNASSIGNED].append(i)
    for laser, found in by_laser.items():
        dots = rr.Points3D(points[found], colors=colors.get(laser, at.WHITE), radii=_DOT)
        stream.log(at.under(at.SPOTS_ON_TARGET, laser), dots)


def log_ranged(
    stream: Stream, lasers: Sequence[LaserRange], geometry: Geometry, colors: Mapping[str, at.Rgb]
) -> None:
    """Log ranged points on their rays."""
    known = [one for one in lasers if one.laser_id in geometry.rays]
    points = [geometry.ray_at(one.laser_id, one.range_mm + geometry.offset_mm) for one in known]
    dots = rr.Points3D(points, colors=[colors[one.laser_id] for one in known], radii=_DOT if points else None)
    stream.log(at.RANGED_POINTS, dots)


def _outline(placement: Placement, z_mm: float) -> list[list[Point]]:
    """Outline of the target with its standoff point at depth `z_mm`."""
    target = placement.target
    match target:
        case FlatTarget() | BoardTarget():
            return _flat(target, z_mm)
        case CylinderTarget():
            return _cylinder(target, z_mm)
        case PolynomialTarget():
            return _upright([(x, z_mm + _polynomial(target, x)) for x in _across()])
        case NoTarget():
            return []


def _flat(target: FlatTarget | BoardTarget, z_mm: float) -> list[list[Point]]:
    h = TARGET_HALF_MM
    slope_x, slope_y = tan(radians(target.yaw_deg)), tan(radians(target.pitch_deg))
    corners = [(-h, -h), (h, -h), (h, h), (-h, h), (-h, -h)]
    edge = [(x, y, z_mm + slope_x * x + slope_y * y) for x, y in corners]
    cross = [[(-h, 0.0, z_mm - slope_x * h), (h, 0.0, z_mm + slope_x * h)]]
    return [edge, *cross, [(0.0, -h, z_mm - slope_y * h), (0.0, h, z_mm + slope_y * h)]]


def _cylinder(target: CylinderTarget, z_mm: float) -> list[list[Point]]:
    r = target.diameter_mm / 2
    angles = np.linspace(0.0, 2 * pi, 49)
    return _upright([(target.shift_mm + r * sin(a), z_mm + r * (1 - cos(a))) for a in angles.tolist()])


def _polynomial(target: PolynomialTarget, x_mm: float) -> float:
    x = x_mm - target.shift_mm
    return float(sum(c * x ** (k + 1) for k, c in enumerate(target.coefficients)))


def _across() -> list[float]:
    return [float(x) for x in np.linspace(-TARGET_HALF_MM, TARGET_HALF_MM, 33)]


def _upright(section: Sequence[tuple[float, float]]) -> list[list[Point]]:
    """Outline of a vertical surface from its (x, z) section: three copies and the edges between them."""
    levels = (-TARGET_HALF_MM, 0.0, TARGET_HALF_MM)
    copies: list[list[Point]] = [[(x, y, z) for x, z in section] for y in levels]
    edges: list[list[Point]] = [
        [(x, levels[0], z), (x, levels[-1], z)] for x, z in section[:: len(section) - 1]
    ]
    return copies + edges
