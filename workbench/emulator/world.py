"""Bodies of a world around the sensor, as surfaces that spots are painted on, mm.

Every body is convex: an intersection of half spaces, or of a round bar and the slab between its ends. A ray
enters it at the last of its entries and leaves it at the first of its exits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, hypot, radians, sin, tan

import numpy as np

from workbench.emulator.beam import Beam
from workbench.emulator.lens import Lens
from workbench.model.arrays import BoolArray, FloatArray, IndexArray
from workbench.model.target import WorldTarget
from workbench.model.world import (
    BoxBody,
    CylinderBody,
    Frame,
    PlacedSolid,
    PlaneBody,
    PoleBody,
    PrismBody,
    RampBody,
    World,
)

UP = np.array([0.0, 0.0, 1.0])
MOTION_STEP_S = 1e-3
"""Time of the derivative by the vehicle's motion."""
INSIDE_MM = 1e-6
"""Depth in a wall or floor from which a point is behind it."""
NOT_ITSELF = 1 - 1e-9
"""Share of the path to a point before which another body hides it."""


@dataclass(frozen=True)
class Convex:
    """Intersection of half spaces n x <= c."""

    normals: FloatArray
    """(k, 3) unit normals, outwards."""
    limits: FloatArray
    """(k,)"""
    centre: FloatArray
    radius: float
    """Sphere around the body; infinite for a body without ends."""

    def span(self, origin: FloatArray, direction: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(n,) t of entry and of exit of each ray; entry > exit where it misses."""
        # Rows are half spaces: numpy reduces over the first axis several times as fast.
        gap = self.limits[:, None] - self.normals @ origin.reshape(-1, 3).T
        along = self.normals @ direction.T
        with np.errstate(divide="ignore", invalid="ignore"):
            t = gap / along
        enter = np.where(along < 0, t, -np.inf).max(axis=0)
        leave = np.where(along > 0, t, np.inf).min(axis=0)
        outside = ((along == 0) & (gap < 0)).any(axis=0)
        return np.where(outside, np.inf, enter), leave

    def normal(self, points: FloatArray) -> FloatArray:
        """(n, 3) normals at points on the surface."""
        depth = self.normals @ points.T - self.limits[:, None]
        return np.asarray(self.normals[depth.argmax(axis=0)])


@dataclass(frozen=True)
class Bar:
    """Round bar between two flat ends."""

    start: FloatArray
    axis: FloatArray
    """Unit vector from the start to the other end."""
    length: float
    thickness: float
    """Radius of the bar."""

    @property
    def centre(self) -> FloatArray:
        """Centre of the sphere around the bar."""
        return np.asarray(self.start + self.axis * self.length / 2)

    @property
    def radius(self) -> float:
        """Radius of that sphere."""
        return hypot(self.length / 2, self.thickness)

    def span(self, origin: FloatArray, direction: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `Convex.span`."""
        o = origin - self.start
        o_along, d_along = o @ self.axis, direction @ self.axis
        o_across, d_across = (
            o - np.multiply.outer(o_along, self.axis),
            direction - np.outer(d_along, self.axis),
        )
        a = np.einsum("ij,ij->i", d_across, d_across)
        half_b = (o_across * d_across).sum(axis=-1)
        c = (o_across * o_across).sum(axis=-1) - self.thickness**2
        with np.errstate(divide="ignore", invalid="ignore"):
            root = np.sqrt(half_b**2 - a * c)  # NaN: the ray passes beside the bar
            enter, leave = (-half_b - root) / a, (-half_b + root) / a
            ends = np.sort([-o_along / d_along, (self.length - o_along) / d_along], axis=0)
        inside = (a == 0) & (c <= 0)
        enter = np.where(inside, -np.inf, np.where(np.isnan(enter), np.inf, enter))
        leave = np.where(inside, np.inf, np.where(np.isnan(leave), -np.inf, leave))
        between = (d_along == 0) & (o_along >= 0) & (o_along <= self.length)
        low = np.where(d_along == 0, np.where(between, -np.inf, np.inf), ends[0])
        high = np.where(d_along == 0, np.where(between, np.inf, -np.inf), ends[1])
        return np.maximum(enter, low), np.minimum(leave, high)

    def normal(self, points: FloatArray) -> FloatArray:
        """See `Convex.normal`."""
        along = (points - self.start) @ self.axis
        across = points - self.start - np.outer(along, self.axis)
        distance = np.linalg.norm(across, axis=1)
        beyond = np.abs(along - self.length / 2) - self.length / 2
        at_end = beyond > distance - self.thickness
        ends = np.outer(np.sign(along - self.length / 2), self.axis)
        return np.where(at_end[:, None], ends, across / np.maximum(distance, 1e-12)[:, None])


class WorldBodies:
    """Bodies of a world, in the world's frame."""

    def __init__(self, world: World, albedo: float) -> None:
        """Place the bodies; `albedo` is the reflectance of those that state none."""
        placed = world.placed()
        self.bodies = [_body(one) for one in placed]
        self.albedos = [albedo if one.solid.albedo is None else one.solid.albedo for one in placed]
        self._planes = np.array(
            [n for n, one in enumerate(placed) if isinstance(one.solid, PlaneBody)], np.intp
        )
        self._others = np.setdiff1d(np.arange(len(placed)), self._planes)
        planes = [body for body in self.bodies if isinstance(body, Convex) and np.isinf(body.radius)]
        self._normals = np.array([plane.normals[0] for plane in planes]).reshape(-1, 3)
        self._limits = np.array([plane.limits[0] for plane in planes])
        others = [self.bodies[n] for n in self._others]
        self._centres = np.array([body.centre for body in others]).reshape(-1, 3)
        self._radii = np.array([body.radius for body in others])
        bars = [body if isinstance(body, Bar) else None for body in others]
        self._axes = np.array([np.zeros(3) if bar is None else bar.axis for bar in bars]).reshape(-1, 3)
        self._thickness = np.array([np.inf if bar is None else bar.thickness for bar in bars])

    def first(self, origin: FloatArray, direction: FloatArray) -> IndexArray:
        """(n,) index of the first body that each ray of a bundle meets; -1: none.

        Args:
            origin: (n, 3) origins; the bundle's axis is the first ray.
            direction: (n, 3)
        """
        gap, along = self._limits - origin @ self._normals.T, direction @ self._normals.T
        with np.errstate(divide="ignore", invalid="ignore"):
            to_planes = np.where((along < 0) & (gap < 0), gap / along, np.inf)
        nearest = to_planes.min(axis=1, initial=np.inf)
        index = np.full(len(direction), -1, np.intp)
        if len(self._planes):
            index = np.where(np.isfinite(nearest), self._planes[to_planes.argmin(axis=1)], -1)
        aside, spread = (float(np.abs(rays - rays[0]).max()) for rays in (origin, direction))
        for n in self._near(origin[0], direction[0], aside, spread):
            t = entry(self.bodies[n], origin, direction)
            closer = t < nearest
            nearest[closer], index[closer] = t[closer], n
        return index

    def reached(self, own: int, source: FloatArray, points: FloatArray) -> BoolArray:
        """(n,) whether no body but `own` lies between a source (3,) and points (n, 3)."""
        path = points - source
        inside = points @ self._normals.T < self._limits - INSIDE_MM
        free: BoolArray = ~inside[:, self._planes != own].any(axis=1)
        middle = path.mean(axis=0)
        for n in self._near(source, middle, 0.0, float(np.abs(path - middle).max())):
            if n != own:
                free &= entry(self.bodies[n], source, path) >= NOT_ITSELF
        return free

    def _near(self, origin: FloatArray, direction: FloatArray, aside: float, spread: float) -> IndexArray:
        """Bodies with ends that rays may meet, within `aside` of the origin and `spread` of the direction."""
        to_centre = self._centres - origin
        scale = float(np.linalg.norm(direction))
        t = np.maximum(to_centre @ direction / scale**2, 0.0)
        aside_of_axis = to_centre - np.outer(t, direction)
        distance = np.sqrt(np.einsum("ij,ij->i", aside_of_axis, aside_of_axis))
        # A ray meets a body at most its radius beyond the foot of the perpendicular; twice, to be safe.
        width = np.sqrt(3) * (aside + spread * (t + 2 * self._radii / scale))
        x, y, z = direction
        across = self._axes @ np.array([(0.0, z, -y), (-z, 0.0, x), (y, -x, 0.0)])  # direction x axis
        length = np.sqrt(np.einsum("ij,ij->i", across, across))
        with np.errstate(divide="ignore", invalid="ignore"):
            between_axes = (
                np.abs(np.einsum("ij,ij->i", to_centre, across)) / length
            )  # NaN: parallel, or no bar
        misses = (distance > self._radii + width) | (between_axes > self._thickness + width)
        return np.asarray(self._others[~misses])


class WorldView:
    """World before the camera at one pose of the vehicle."""

    def __init__(self, bodies: WorldBodies, target: WorldTarget, offset_mm: float) -> None:
        """View at the pose of `target`; the pinhole lies `offset_mm` behind the vehicle's front."""
        angle = radians(target.pose.heading_deg)
        ahead = np.array([cos(angle), sin(angle), 0.0])
        self.axes = np.array([[sin(angle), -cos(angle), 0.0], -UP, ahead])
        front = np.array([target.pose.x_mm, target.pose.y_mm, target.vehicle.sensor_height_mm])
        self.pinhole = front - offset_mm * ahead
        self.bodies = bodies
        self.speed_mm_s = target.speed_mm_s

    def world_point(self, points: FloatArray) -> FloatArray:
        """Points of the camera frame in the world."""
        return np.asarray(points @ self.axes + self.pinhole)

    def met_by(self, beam: Beam) -> list[BodySurface]:
        """Bodies that a beam meets first, with any part of its section."""
        origins, directions = beam.section
        index = self.bodies.first(self.world_point(origins), directions @ self.axes)
        return [BodySurface(self, n) for n in sorted({*index.tolist()} - {-1})]

    def motion(self, beam: Beam, surface: BodySurface, lens: Lens) -> tuple[float, float]:
        """Velocity of the spot in the image, px/s, by the vehicle's speed; 0 for a spot beside the axis."""
        if not self.speed_mm_s:
            return 0.0, 0.0
        step_mm = self.speed_mm_s * MOTION_STEP_S
        ray = beam.direction[None]
        now, later = (
            surface.depth(beam.origin + np.array([0.0, 0.0, moved]), ray)[0] for moved in (0.0, step_mm)
        )
        if not np.isfinite(now) or not np.isfinite(later):
            return 0.0, 0.0
        (u0, v0), (u1, v1) = lens.project(beam.origin + np.outer([now, later], beam.direction))
        return float(u1 - u0) / MOTION_STEP_S, float(v1 - v0) / MOTION_STEP_S


@dataclass(frozen=True)
class BodySurface:
    """Surface of one body of a world, hidden where other bodies stand before it."""

    view: WorldView
    index: int

    @property
    def albedo(self) -> float:
        """See `Surface`."""
        return self.view.bodies.albedos[self.index]

    @property
    def _body(self) -> Convex | Bar:
        return self.view.bodies.bodies[self.index]

    def depth(self, origin: FloatArray, direction: FloatArray) -> FloatArray:
        """See `Surface`; other bodies are left to `unhidden`."""
        t = entry(self._body, self.view.world_point(origin), direction @ self.view.axes)
        return np.where(np.isfinite(t), t, np.nan)

    def normal(self, points: FloatArray) -> FloatArray:
        """See `Surface`."""
        return np.asarray(self._body.normal(self.view.world_point(points)) @ self.view.axes.T)

    def shade(self, points: FloatArray) -> float:
        """See `Surface`."""
        return 1.0

    def unhidden(self, source: FloatArray, points: FloatArray) -> BoolArray:
        """See `Surface`."""
        at = self.view.world_point(points)
        free = self.view.bodies.reached(self.index, self.view.pinhole, at)
        if free.any():
            free[free] = self.view.bodies.reached(self.index, self.view.world_point(source), at[free])
        return free


def _body(placed: PlacedSolid) -> Convex | Bar:
    solid, frame = placed.solid, placed.frame
    if isinstance(solid, PlaneBody):
        turned = _turned(frame, solid.normal)
        normal = turned / np.linalg.norm(turned)
        point = _point(frame, solid.point_mm)
        return Convex(normal[None], np.array([normal @ point]), point, np.inf)
    if isinstance(solid, CylinderBody):
        x, y = solid.at_mm
        if not solid.lies:
            start, axis = (x, y, solid.base_mm), UP
        else:
            angle = radians(solid.heading_deg)
            axis = np.array([cos(angle), sin(angle), 0.0])
            half = solid.length_mm / 2
            start = (x - axis[0] * half, y - axis[1] * half, solid.base_mm + solid.radius_mm)
        return Bar(_point(frame, start), _turned(frame, axis), solid.length_mm, solid.radius_mm)
    if isinstance(solid, PoleBody):
        start_mm, end_mm = _point(frame, solid.from_mm), _point(frame, solid.to_mm)
        length = float(np.linalg.norm(end_mm - start_mm))
        return Bar(start_mm, (end_mm - start_mm) / length, length, solid.diameter_mm / 2)
    return _polyhedron(solid, frame)


def _polyhedron(solid: BoxBody | PrismBody | RampBody, frame: Frame) -> Convex:
    """Half spaces and bounding sphere of an upright solid over a convex polygon."""
    base = np.array([(*frame.point(*corner), solid.base_mm) for corner in _corners(solid)])
    sides = np.roll(base, -1, axis=0) - base
    normals = np.cross(sides, UP)
    height = solid.size_mm[2] if isinstance(solid, BoxBody) else solid.height_mm
    top = base + height * UP
    if isinstance(solid, RampBody):
        angle = radians(solid.heading_deg + frame.heading_deg)
        rise = tan(radians(solid.angle_deg))
        upper, on_upper = np.array([-rise * cos(angle), -rise * sin(angle), 1.0]), base[0]
    else:
        upper, on_upper = UP, top[0]
    normals = np.array([*normals, -UP, upper])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    limits = (normals * np.array([*base, base[0], on_upper])).sum(axis=1)
    around = np.array([*base, *top])
    centre = around.mean(axis=0)
    return Convex(normals, limits, centre, float(np.linalg.norm(around - centre, axis=1).max()))


def entry(body: Convex | Bar, origin: FloatArray, direction: FloatArray) -> FloatArray:
    """(n,) t > 0 at which rays enter a body from outside; infinite where they do not."""
    enter, leave = body.span(origin, direction)
    return np.where((enter > 0) & (enter <= leave), enter, np.inf)


def _corners(solid: BoxBody | PrismBody | RampBody) -> list[tuple[float, float]]:
    """Corners of the base, anticlockwise; of a ramp the low end first."""
    if isinstance(solid, PrismBody):
        return list(solid.corners_mm)
    length, width = solid.size_mm[:2] if isinstance(solid, BoxBody) else (solid.length_mm, solid.width_mm)
    own = Frame(*solid.at_mm, solid.heading_deg)
    half_l, half_w = length / 2, width / 2
    return [
        own.point(x, y)
        for x, y in ((-half_l, half_w), (-half_l, -half_w), (half_l, -half_w), (half_l, half_w))
    ]


def _point(frame: Frame, point: Sequence[float]) -> FloatArray:
    return np.array([*frame.point(point[0], point[1]), point[2]])


def _turned(frame: Frame, vector: Sequence[float] | FloatArray) -> FloatArray:
    """Direction of the world by that of an object."""
    origin = np.array([*frame.point(0.0, 0.0), 0.0])
    return np.asarray(_point(frame, tuple(vector)) - origin)
