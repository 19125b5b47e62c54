"""Beams of one emitter, which are on together: their order along their row assigns their spots.

A beam with the origin (x, y) and the direction (tx, ty) has its spot on a wall at the depth z at
(x, y) + z (tx, ty). The undistorted image is that divided by z. The distance of two spots along the row is
linear in z. Where it has the same sign at both ends of a reach, it has this sign everywhere between, on
the wall and in the image.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.model.errors import BadInputError
from workbench.model.rig import LaserSpec, Rig
from workbench.optics.rows import rays_of_rig, rows_of

LEAST_DEPTH_MM = 1.0
"""Least depth of a target in front of the pinhole."""


def depths_mm(rig: Rig) -> tuple[float, float]:
    """Nearest and farthest depth of a target by the rig file, from the pinhole."""
    near, far = (standoff_mm + rig.bench.offset_mm.value for standoff_mm in rig.bench.reach_mm)
    return max(near, LEAST_DEPTH_MM), max(far, LEAST_DEPTH_MM)


def beams_together(rig: Rig, laser: LaserSpec) -> tuple[LaserSpec, ...]:
    """Lasers that are on with a laser, with itself, in the file's order."""
    (together,) = [group for group in rig.emitters if laser in group]
    return together


def beams_in_order(rig: Rig, together: Sequence[LaserSpec]) -> tuple[tuple[LaserSpec, ...], FloatArray]:
    """Beams of one emitter in the order of their spots along their row, and its (2,) unit vector.

    Raises:
        BadInputError: the beams are not in one row, or two of them cross within the rig's reach.
    """
    rays = rays_of_rig(rig.model_copy(update={"lasers": tuple(together)}))
    name = together[0].emitter
    rows = rows_of(rays)
    if len(rows) > 1:
        raise BadInputError(
            f"rig {rig.rig}: expected the beams of emitter {name} in one row, got {len(rows)} rows;"
            " correct their x_mm, y_mm, tx and ty, or give lasers that fire alone no emitter"
        )
    near, far = (
        np.argsort((rays[:, :2] + depth * rays[:, 2:]) @ rows[0].direction).tolist()
        for depth in depths_mm(rig)
    )
    if near != far:
        nearest_mm, farthest_mm = rig.bench.reach_mm
        first, second = next((a, b) for a, b in pairwise(near) if far.index(a) > far.index(b))
        raise BadInputError(
            f"rig {rig.rig}: expected beams of emitter {name} that do not cross within {nearest_mm:g} to"
            f" {farthest_mm:g} mm, because their order assigns their spots; got {together[first].id} and"
            f" {together[second].id}, which cross; correct their x_mm, y_mm, tx and ty, or bench.reach_mm"
        )
    return tuple(together[n] for n in near), rows[0].direction


def emitter_problems(rig: Rig) -> Iterator[tuple[int, BadInputError]]:
    """Emitters whose spots cannot be assigned: index of the first laser of each, with the error."""
    for together in rig.emitters:
        if len(together) > 1:
            try:
                beams_in_order(rig, together)
            except BadInputError as error:
                yield rig.laser_ids.index(together[0].id), error
