"""3D view of the bench: camera, laser rays, target and spots, in the camera frame.

x and y are millimetres. Depth is drawn relative to that of the target, which always lies at `DRAWN_DEPTH_MM`:
a target at 140 mm and one at 4 m are then seen equally well from one place.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
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
    WorldTarget,
)
from workbench.viewer import entities as at
from workbench.viewer.frame import RERUN_PIXEL_CENTRE
from workbench.viewer.geometry import Geometry
from workbench.viewer.stream import Stream

DRAWN_DEPTH_MM = 600.0
"""Depth at which the target is drawn at every standoff."""
BEYOND = 1.15
"""Length of the drawn rays, relative to the depth of the target."""
TARGET_HALF_MM = 150.0
"""Half side of the drawn target, whose real size is unknown."""
LEAST_DEPTH_MM = 1.0
"""Least depth of a target, for a standoff that the offset of the pinhole makes 0 or negative."""
_FRUSTUM_MM = 90.0
_TARGET_COLOR = (235, 235, 235, 60)
_LINE = rr.Radius.ui_points(1.5)
_DOT = rr.Radius.ui_points(5.0)
_NO_DOT = rr.Radius.ui_points(0.0)

Point = tuple[float, float, float]


def log_camera(stream: Stream, camera: CameraSpec, geometry: Geometry) -> None:
    """Log orientation and frustum of the camera, without an image, which would hide the beams."""
    stream.log(at.BENCH, rr.ViewCoordinates.RDF, static=True)
    matrix = geometry.camera_matrix
    matrix[:2, 2] += RERUN_PIXEL_CENTRE
    pinhole = rr.Pinhole(
        image_from_camera=matrix,
        resolution=[camera.width_px, camera.height_px],
        camera_xyz=rr.ViewCoordinates.RDF,
        image_plane_distance=_FRUSTUM_MM,
        color=at.GREY,
        line_width=-1.2,  # in screen points
    )
    stream.log(at.CAMERA, pinhole)


def log_placement(
    stream: Stream, placement: Placement, geometry: Geometry, colors: Mapping[str, at.Rgb]
) -> None:
    """Log rays and target at a placement, and clear the points of the previous one."""
    scale = depth_scale(placement, geometry)
    for n, (laser, color) in enumerate(colors.items()):
        far_mm = BEYOND * DRAWN_DEPTH_MM / scale
        ray = _drawn([geometry.ray_at(laser, 0.0), geometry.ray_at(laser, far_mm)], scale)
        stream.log(at.under(at.RAYS, laser), rr.LineStrips3D([ray], colors=color, radii=_LINE))
        exit_mm = (ray[0][0], ray[0][1] - 25.0 - 25.0 * (n % 2), ray[0][2])
        name = rr.Points3D([exit_mm], labels=[laser], colors=color, radii=_NO_DOT, show_labels=True)
        stream.log(at.under(at.RAYS, laser, "label"), name)
    z_mm = placement.standoff_mm + geometry.offset_mm
    outline = [_drawn(strip, scale) for strip in _outline(placement, z_mm)]
    stream.log(at.TARGET, rr.LineStrips3D(outline, colors=at.WHITE, radii=_LINE if outline else None))
    _log_face(stream, outline, placement)
    below = [(0.0, TARGET_HALF_MM + 15.0, DRAWN_DEPTH_MM)] if outline else []
    text = f"{_kind(placement)} at {placement.standoff_mm:g} mm"
    label = rr.Points3D(below, labels=[text] * len(below), colors=at.WHITE, radii=_NO_DOT if below else None)
    stream.log(f"{at.TARGET}/label", label)
    for entity in (at.SPOTS_ON_TARGET, at.RANGED_POINTS):
        stream.log(entity, rr.Clear(recursive=True))


def depth_scale(placement: Placement, geometry: Geometry) -> float:
    """Drawn over true depth at a placement."""
    return DRAWN_DEPTH_MM / max(placement.standoff_mm + geometry.offset_mm, LEAST_DEPTH_MM)


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
    points[:, 2] *= depth_scale(placement, geometry)
    by_laser: dict[str, list[int]] = defaultdict(list)
    for i, spot in enumerate(spots):
        by_laser[spot.laser_id or at.UNASSIGNED].append(i)
    for laser, found in by_laser.items():
        dots = rr.Points3D(points[found], colors=at.packed([colors.get(laser, at.WHITE)]), radii=_DOT)
        stream.log(at.under(at.SPOTS_ON_TARGET, laser), dots)


def log_ranged(
    stream: Stream,
    lasers: Sequence[LaserRange],
    placement: Placement,
    geometry: Geometry,
    colors: Mapping[str, at.Rgb],
) -> None:
    """Log ranged points on their rays, and their 95 % intervals along them."""
    scale = depth_scale(placement, geometry)
    known = [one for one in lasers if one.laser_id in geometry.rays]
    points = _drawn([geometry.ray_at(o.laser_id, o.range_mm + geometry.offset_mm) for o in known], scale)
    drawn_colors = [colors[one.laser_id] for one in known]
    stream.log(at.RANGED_POINTS, rr.Points3D(points, colors=drawn_colors, radii=_DOT if points else None))
    bars = [
        _drawn([geometry.ray_at(o.laser_id, end + geometry.offset_mm) for end in _interval(o)], scale)
        for o in known
    ]
    stream.log(
        f"{at.RANGED_POINTS}/intervals",
        rr.LineStrips3D(bars, colors=drawn_colors, radii=rr.Radius.ui_points(3.0) if bars else None),
    )


def _interval(one: LaserRange) -> tuple[float, float]:
    """95 % interval of a range; by its deviation where no end is known."""
    low = one.range_mm - 2.0 * one.sigma_mm if one.low_mm is None else one.low_mm
    high = one.range_mm + 2.0 * one.sigma_mm if one.high_mm is None else one.high_mm
    return low, high


def _drawn(points: Iterable[Point], scale: float) -> list[Point]:
    return [(x, y, scale * z) for x, y, z in points]


def _kind(placement: Placement) -> str:
    target = placement.target
    if isinstance(target, FlatTarget) and (target.yaw_deg or target.pitch_deg):
        return f"incline of {target.yaw_deg or target.pitch_deg:g} deg"
    if isinstance(target, CylinderTarget):
        return f"cylinder of {target.diameter_mm:g} mm"
    return target.shape


def _log_face(stream: Stream, outline: Sequence[Sequence[Point]], placement: Placement) -> None:
    """Log the face of a flat target, translucent, so that the rays are visible through it."""
    if not isinstance(placement.target, FlatTarget | BoardTarget):
        stream.log(f"{at.TARGET}/face", rr.Clear(recursive=False))
        return
    corners = list(outline[0][:4])
    face = rr.Mesh3D(
        vertex_positions=corners, triangle_indices=[(0, 1, 2), (0, 2, 3)], albedo_factor=_TARGET_COLOR
    )
    stream.log(f"{at.TARGET}/face", face)


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
        case NoTarget() | WorldTarget():  # a world has a view of its own
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
