"""Truth of a drive: distances in the world as its file states them, in the frame of the world, mm.

Solids with flat faces are sets of triangles, round ones the exact quadric with discs at the ends. The virtual
bench has intersections of its own, by half spaces, so that neither is tested against itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, radians, sin
from typing import NamedTuple

import numpy as np

from workbench.model.arrays import FloatArray, IndexArray
from workbench.model.world import (
    BoxBody,
    CylinderBody,
    Frame,
    PlacedSolid,
    PlaneBody,
    PoleBody,
    Pose,
    PrismBody,
    RampBody,
    Vehicle,
    World,
)

FACETS = 256
"""Facets of a round solid that is not upright, for the clearance: within 0.02 mm at a radius of 200 mm."""
HALF_PLANE_MM = 1e6
"""Half side of the square that stands for a plane without ends."""


class Hits(NamedTuple):
    """First intersections of n rays."""

    distance_mm: FloatArray
    """(n,) in lengths of the direction; infinite where nothing is met."""
    body: IndexArray
    """(n,) index of the solid; -1 where nothing is met."""
    normal: FloatArray
    """(n, 3) unit normals of either sign; 0 where nothing is met."""


class Clearance(NamedTuple):
    """Free way ahead of the vehicle."""

    distance_mm: float
    """Distance along the heading at which its front touches the nearest body; infinite without one."""
    body: int
    """Index of that body; -1 without one."""


@dataclass(frozen=True)
class _Round:
    """Round bar between two discs."""

    start: FloatArray
    end: FloatArray
    radius_mm: float


class Surroundings:
    """Surfaces of a world."""

    def __init__(self, world: World) -> None:
        placed = world.placed()
        self.names = [one.name for one in placed]
        self._faces = [_faces(one) for one in placed]
        self._rounds = [_round(one) for one in placed]
        triangles = [
            (n, face[0], face[k], face[k + 1])
            for n, faces in enumerate(self._faces)
            for face in faces
            for k in range(1, len(face) - 1)
        ]
        self._owner = np.array([n for n, *_ in triangles], np.intp)
        corners = np.array([corner for _, *corner in triangles]).reshape(-1, 3, 3)
        self._corner, self._side_1, self._side_2 = (
            corners[:, 0],
            corners[:, 1] - corners[:, 0],
            corners[:, 2] - corners[:, 0],
        )

    def first_hits(self, origins: FloatArray, directions: FloatArray) -> Hits:
        """First intersections of rays: origins (n, 3), directions (n, 3)."""
        count = len(directions)
        distance, body, normal = np.full(count, np.inf), np.full(count, -1, np.intp), np.zeros((count, 3))
        if len(self._owner):
            t = self._triangle_distances(origins, directions)
            nearest = t.argmin(axis=1)
            distance = t[np.arange(count), nearest]
            met = np.isfinite(distance)
            body = np.where(met, self._owner[nearest], -1)
            normal[met] = np.cross(self._side_1, self._side_2)[nearest[met]]
        for n, one in enumerate(self._rounds):
            if one is not None:
                t, normals = _round_distances(one, origins, directions)
                closer = t < distance
                distance[closer], body[closer] = t[closer], n
                normal[closer] = normals[closer]
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        return Hits(distance, body, normal / np.maximum(length, np.finfo(float).tiny))

    def clearance(self, pose: Pose, vehicle: Vehicle) -> Clearance:
        """Way that the vehicle can drive straight ahead until its front touches a body."""
        found = [self._touch_mm(n, pose, vehicle) for n in range(len(self.names))]
        nearest = int(np.argmin(found))
        return Clearance(found[nearest], nearest if np.isfinite(found[nearest]) else -1)

    def points(self) -> list[FloatArray]:
        """Points of each solid in whose directions rays meet it: axes of round ones, corners of others."""
        return [
            np.concatenate(faces) if one is None else np.linspace(one.start, one.end, 9)
            for faces, one in zip(self._faces, self._rounds, strict=True)
        ]

    def _triangle_distances(self, origins: FloatArray, directions: FloatArray) -> FloatArray:
        """(n, triangles) distances along each ray, infinite where it misses (Moeller, Trumbore 1997)."""
        across = np.cross(directions[:, None], self._side_2)
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = 1 / (across * self._side_1).sum(axis=2)
            from_corner = origins[:, None] - self._corner
            u = scale * (from_corner * across).sum(axis=2)
            other = np.cross(from_corner, self._side_1)
            v = scale * (other * directions[:, None]).sum(axis=2)
            t = scale * (other * self._side_2).sum(axis=2)
            met = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
        return np.where(met, t, np.inf)

    def _touch_mm(self, n: int, pose: Pose, vehicle: Vehicle) -> float:
        """Distance along the heading at which the vehicle's front touches a solid; infinite if it passes."""
        half = vehicle.width_mm / 2
        low, high = vehicle.clearance_mm, vehicle.height_mm
        one = self._rounds[n]
        if one is not None and one.start[0] == one.end[0] and one.start[1] == one.end[1]:
            ahead, left, bottom = vehicle_frame(pose, one.start[None])[0]
            top = bottom + one.end[2] - one.start[2]
            aside = left - min(max(left, -half), half)
            if max(low, min(bottom, top)) >= min(high, max(bottom, top)) or abs(aside) >= one.radius_mm:
                return np.inf
            reach = float(np.sqrt(one.radius_mm**2 - aside**2))
            return max(0.0, float(ahead) - reach) if ahead + reach > 0 else np.inf
        faces = self._faces[n] if one is None else _facets(one)
        nearest = np.inf
        for face in faces:
            corners = vehicle_frame(pose, face)
            for axis, limit, sign in ((1, half, 1), (1, -half, -1), (2, high, 1), (2, low, -1), (0, 0.0, -1)):
                corners = _clipped(corners, axis, limit, sign)
                if not len(corners):
                    break
            else:
                nearest = min(nearest, float(corners[:, 0].min()))
        return nearest


def vehicle_frame(pose: Pose, points: FloatArray) -> FloatArray:
    """Points (n, 3) of the world as (ahead, to the left, up) of the vehicle."""
    c, s = cos(radians(pose.heading_deg)), sin(radians(pose.heading_deg))
    x, y = points[:, 0] - pose.x_mm, points[:, 1] - pose.y_mm
    return np.column_stack([c * x + s * y, c * y - s * x, points[:, 2]])


def world_rays(
    pose: Pose, vehicle: Vehicle, origins: FloatArray, directions: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Rays in the world by those in the camera frame at the vehicle's front (x right, y down, z ahead).

    Args:
        pose: pose of the vehicle.
        vehicle: vehicle with the height of the camera.
        origins: (n, 3) with z from the front.
        directions: (n, 3)
    """
    c, s = cos(radians(pose.heading_deg)), sin(radians(pose.heading_deg))
    turn = np.array([[s, -c, 0.0], [0.0, 0.0, -1.0], [c, s, 0.0]])
    front = np.array([pose.x_mm, pose.y_mm, vehicle.sensor_height_mm])
    return origins @ turn + front, directions @ turn


def _clipped(corners: FloatArray, axis: int, limit: float, sign: int) -> FloatArray:
    """Part of a convex polygon (n, 3) with sign * coordinate < sign * limit (Sutherland, Hodgman 1974)."""
    inside = sign * (limit - corners[:, axis])
    kept: list[FloatArray] = []
    for n in range(len(corners)):
        a, b, da, db = corners[n - 1], corners[n], inside[n - 1], inside[n]
        if da * db < 0:
            kept.append(a + (b - a) * da / (da - db))
        if db >= 0:
            kept.append(b)
    return np.array(kept).reshape(-1, 3)


def _round_distances(
    one: _Round, origins: FloatArray, directions: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(n,) distances along rays to the side or an end of a round bar, and (n, 3) normals there."""
    length = float(np.linalg.norm(one.end - one.start))
    axis = (one.end - one.start) / length
    best, normals = np.full(len(directions), np.inf), np.zeros_like(directions)
    o = origins - one.start
    slide, rise = o @ axis, directions @ axis
    across_o, across_d = o - np.outer(slide, axis), directions - np.outer(rise, axis)
    a, b = (across_d**2).sum(axis=1), 2 * (across_o * across_d).sum(axis=1)
    c = (across_o**2).sum(axis=1) - one.radius_mm**2
    with np.errstate(divide="ignore", invalid="ignore"):
        side = (-b - np.sqrt(b**2 - 4 * a * c)) / (2 * a)
        height = slide + side * rise
        met = (side > 0) & (height >= 0) & (height <= length)
        best[met], normals[met] = side[met], (across_o + side[:, None] * across_d)[met]
        for end, at in ((one.start, 0.0), (one.end, length)):
            t = (at - slide) / rise
            aside = origins + t[:, None] * directions - end
            met = (t > 0) & ((aside**2).sum(axis=1) <= one.radius_mm**2) & (t < best)
            best[met], normals[met] = t[met], axis
    return best, normals


def _facets(one: _Round) -> list[FloatArray]:
    """Polygons around a round bar, with corners on its surface."""
    axis = (one.end - one.start) / np.linalg.norm(one.end - one.start)
    first = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    angle = np.linspace(0, 2 * np.pi, FACETS, endpoint=False)[:, None]
    ring = one.radius_mm * (np.cos(angle) * first + np.sin(angle) * second)
    lower, upper = one.start + ring, one.end + ring
    sides = [np.array([lower[n - 1], lower[n], upper[n], upper[n - 1]]) for n in range(FACETS)]
    return [*sides, lower, upper]


def _round(placed: PlacedSolid) -> _Round | None:
    solid, frame = placed.solid, placed.frame
    if isinstance(solid, PoleBody):
        start, end = (_moved(frame, [point])[0] for point in (solid.from_mm, solid.to_mm))
        return _Round(start, end, solid.diameter_mm / 2)
    if not isinstance(solid, CylinderBody):
        return None
    x, y = solid.at_mm
    if not solid.lies:
        ends = [(x, y, solid.base_mm), (x, y, solid.base_mm + solid.length_mm)]
    else:
        own = Frame(x, y, solid.heading_deg)
        half, z = solid.length_mm / 2, solid.base_mm + solid.radius_mm
        ends = [(*own.point(-half, 0.0), z), (*own.point(half, 0.0), z)]
    start, end = _moved(frame, ends)
    return _Round(start, end, solid.radius_mm)


def _faces(placed: PlacedSolid) -> list[FloatArray]:
    """Corners (n, 3) of the flat faces of a solid; none of a round one."""
    solid, frame = placed.solid, placed.frame
    if isinstance(solid, PoleBody | CylinderBody):
        return []
    if isinstance(solid, PlaneBody):
        normal = np.array(solid.normal) / np.linalg.norm(solid.normal)
        along = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
        along *= HALF_PLANE_MM / np.linalg.norm(along)
        other = np.cross(normal, along)
        square = [along + other, along - other, -along - other, -along + other]
        return [_moved(frame, [np.array(solid.point_mm) + corner for corner in square])]
    if isinstance(solid, RampBody):
        return [_moved(frame, face) for face in _ramp_faces(solid)]
    if isinstance(solid, PrismBody):
        base, height = [*solid.corners_mm], solid.height_mm
    else:
        length, width, height = solid.size_mm
        base = _rectangle(solid, length, width)
    low, high = solid.base_mm, solid.base_mm + height
    sides = [
        [(*a, low), (*b, low), (*b, high), (*a, high)]
        for a, b in zip(base, [*base[1:], base[0]], strict=True)
    ]
    ends = [[(*point, z) for point in base] for z in (low, high)]
    return [_moved(frame, face) for face in (*sides, *ends)]


def _ramp_faces(ramp: RampBody) -> list[list[tuple[float, float, float]]]:
    rear_right, front_right, front_left, rear_left = _rectangle(ramp, ramp.length_mm, ramp.width_mm)
    low, high = ramp.base_mm, ramp.base_mm + ramp.height_mm
    return [
        [(*rear_right, low), (*rear_left, low), (*front_left, high), (*front_right, high)],
        [(*front_right, low), (*front_left, low), (*front_left, high), (*front_right, high)],
        [(*rear_right, low), (*front_right, low), (*front_right, high)],
        [(*rear_left, low), (*front_left, low), (*front_left, high)],
        [(*rear_right, low), (*front_right, low), (*front_left, low), (*rear_left, low)],
    ]


def _rectangle(solid: BoxBody | RampBody, length: float, width: float) -> list[tuple[float, float]]:
    """Corners: rear right, front right, front left, rear left of the heading."""
    own = Frame(*solid.at_mm, solid.heading_deg)
    return [own.point(x * length / 2, y * width / 2) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]


def _moved(frame: Frame, points: Sequence[Sequence[float] | FloatArray]) -> FloatArray:
    """Points of an object in the world, (n, 3)."""
    return np.array([(*frame.point(float(x), float(y)), float(z)) for x, y, z in points])
