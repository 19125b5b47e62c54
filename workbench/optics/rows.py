"""Rows of lasers: the straight lines in which their spots lie on a wall, by the rays alone.

The spot of a laser at (x, y) moves in the image along the direction (x, y), the laser's own direction. Which
lasers form a row is another question: their beams lie in one plane, so that a wall shows their spots on one
straight line at any range. A surface is cut by that plane; the cut is the shape in front of the row.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from workbench.model.arrays import BoolArray, FloatArray, IndexArray
from workbench.model.rig import Rig
from workbench.optics.rays import RAY

FLATNESS = 0.05
"""Largest distance of a spot from the line through two others of its row, over the distance of these.

Lasers are placed to a millimetre, and aligned by eye to some 5 mrad: at 200 mm, a fiftieth of a row of 60 mm.
Neighbours on a ring of 12 deviate by 0.13, on one of 30 by 0.053.
"""
DEPTHS_MM = (0.0, 200.0)
"""Depths at which the spots are compared: a row from one point has no length at its origin."""
FEWEST = 3
"""Number of points that can be in a row or not; for two lasers beside others, the pinhole is the third."""
MOUNTED_DEG = 15
"""Rows are mounted at multiples of this angle, unless they clearly deviate."""
MOST_TURNED_DEG = 2.0
"""Largest deviation from such a multiple: errors of 0.2 mm at the ends of a row of 30 mm make 0.5 degrees."""
NAMES = {0: "horizontal", 90: "vertical"}
"""Names of rows by their angle; the others are named by it."""


@dataclass(frozen=True)
class Row:
    """Lasers of one row, or a single laser that is on no row."""

    members: tuple[int, ...]
    """Indices of the lasers in the rig file, ascending."""
    angle_deg: int
    """Direction in degrees from u (x, to the right) towards v (y, down), 0 to 179; of a single laser, its own
    direction. It is the multiple of 15 degrees that the row is mounted at, otherwise a whole number. Errors
    of single lasers do not turn the axis along which positions count."""

    @cached_property
    def lasers(self) -> IndexArray:
        """(n,) indices of the lasers."""
        return np.array(self.members, np.intp)

    @cached_property
    def direction(self) -> FloatArray:
        """(2,) unit vector along the row; positions in the row count along it, from the optical axis."""
        angle = np.radians(self.angle_deg)
        return np.asarray(np.round([np.cos(angle), np.sin(angle)], 15))

    @property
    def name(self) -> str:
        """`horizontal`, `vertical`, or the angle."""
        return NAMES.get(self.angle_deg, f"{self.angle_deg} deg")


def rows_of(rays: FloatArray) -> tuple[Row, ...]:
    """Rows of lasers, by their angle; each laser is in exactly one, in the longest that it may be in.

    The row with the most lasers is taken first, of equally many that of the greatest length, until no three
    lasers are left in a row. Then two lasers are a row if the pinhole lies on its line, as on both sides of
    the camera; and so are the only two lasers of a rig. Each laser that is left stands alone.

    Args:
        rays: (L, 4) in the order of `RAY`.
    """
    rays = np.asarray(rays, float).reshape(-1, len(RAY))
    left, rows = np.arange(len(rays)), []
    while (found := _largest(_points(rays[left]))) is not None:
        rows.append(left[found])
        left = left[~found]
    if len(rays) == 2:
        rows, left = [left], left[:0]
    while (pair := _pair(rays[left])) is not None:
        rows.append(left[pair])
        left = np.delete(left, pair)
    single = [left[n : n + 1] for n in range(len(left))]
    made = [Row(tuple(own.tolist()), _angle_deg(rays[own])) for own in (*rows, *single)]
    return tuple(sorted(made, key=lambda row: (row.angle_deg, row.members)))


def rows_of_rig(rig: Rig) -> tuple[Row, ...]:
    """Rows of a rig as designed, by the values of its file."""
    return rows_of(rays_of_rig(rig))


def rays_of_rig(rig: Rig) -> FloatArray:
    """(L, 4) rays of a rig as designed."""
    return np.array([[getattr(laser, name).value for name in RAY] for laser in rig.lasers]).reshape(-1, 4)


def axes_of(rays: FloatArray) -> FloatArray:
    """(L, 2) unit vectors along which the spots of rays (L, 4) move in the image, as `Row.direction`."""
    return np.array([Row((n,), _angle_deg(ray[None])).direction for n, ray in enumerate(rays)]).reshape(-1, 2)


def _points(rays: FloatArray) -> FloatArray:
    """(D, L, 2) spots at `DEPTHS_MM`."""
    return np.array([rays[:, :2] + depth * rays[:, 2:] for depth in DEPTHS_MM])


def _largest(points: FloatArray) -> BoolArray | None:
    """(L,) members of the largest row; None where no three spots are in one."""
    count = points.shape[1]
    if count < FEWEST:
        return None
    first, second = np.triu_indices(count, 1)
    members, length = _in_row(points, first, second)
    size = members.sum(axis=1)
    best = np.lexsort((length, size))[-1]
    return np.asarray(members[best]) if size[best] >= FEWEST else None


def _in_row(points: FloatArray, first: IndexArray, second: IndexArray) -> tuple[BoolArray, FloatArray]:
    """For P pairs of ends: (P, L) whether each spot is on their line at all depths, and (P,) its length.

    The line has one direction at all depths, that of both ends together.
    """
    between = points[:, second] - points[:, first]  # (D, P, 2)
    reference = between[np.hypot(*np.moveaxis(between, -1, 0)).argmax(axis=0), np.arange(len(first))]
    towards = np.where((between * reference).sum(axis=-1) < 0, -1.0, 1.0)[..., None]
    along = (between * towards).sum(axis=0)
    length = np.hypot(*np.moveaxis(between, -1, 0)).max(axis=0)
    normal = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.maximum(np.hypot(*along.T), 1e-12)[:, None]
    middle = (points[:, first] + points[:, second]) / 2
    away = np.einsum("dplk,pk->dpl", points[:, None] - middle[:, :, None], normal)
    return np.asarray((np.abs(away) <= FLATNESS * length[:, None]).all(axis=0)), length


def _pair(rays: FloatArray) -> IndexArray | None:
    """(2,) indices of two lasers in a row with the pinhole; None if there are none."""
    origins = np.vstack([rays[:, :2], np.zeros((1, 2))])[None]
    pinhole = len(rays)
    for one in range(len(rays)):
        for other in range(one + 1, len(rays)):
            three = np.array([one, other, pinhole])
            first, second = three[[0, 0, 1]], three[[1, 2, 2]]
            members, length = _in_row(origins, first, second)
            if members[length.argmax()][three].all():
                return np.array([one, other])
    return None


def _angle_deg(rays: FloatArray) -> int:
    """Angle of a row, 0 to 179, see `Row`; by the origins of the beams, unless they come from one point."""
    spots = rays[None, :, :2] if len(rays) == 1 else _points(rays)
    if len(rays) > 1:
        spots = spots - spots.mean(axis=1, keepdims=True)
    length = np.linalg.norm(spots, axis=(1, 2))
    u, v = np.linalg.svd(spots[int(2 * length[0] < length[-1]) * -1])[2][0]
    angle = float(np.degrees(np.arctan2(v, u)))
    mounted = MOUNTED_DEG * round(angle / MOUNTED_DEG)
    return (mounted if abs(angle - mounted) <= MOST_TURNED_DEG else round(angle)) % 180
