"""Where a spot and a corner of the board are expected: the one prediction that every fit shares."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from workbench.calibration.model.parameters import LENS, PLACEMENT, POSE, PRINT, RAY, REFERENCE
from workbench.model.board import BOW, BOW_RADIUS_MM
from workbench.optics.board import Pose, point_on_board
from workbench.optics.lens import Lens, project
from workbench.optics.rays import Plane, Ray, spot_on_plane

_LENS = slice(0, len(LENS))
_REFERENCE = slice(_LENS.stop, _LENS.stop + len(REFERENCE))
_RAY = slice(_REFERENCE.stop, _REFERENCE.stop + len(RAY))


class Layout(NamedTuple):
    """How many of each there are, and so where each block of parameters stands among all.

    In order: lens, reference, rays; print scale if there are boards; placements; sag and poses of the boards.
    """

    lasers: int
    placements: int
    boards: int
    """Placements at which the board was seen."""

    @property
    def rays(self) -> slice:
        """RAY of every laser."""
        return slice(_REFERENCE.stop, _REFERENCE.stop + len(RAY) * self.lasers)

    @property
    def errors(self) -> slice:
        """PLACEMENT of every placement."""
        start = self.rays.stop + (len(PRINT) if self.boards else 0)
        return slice(start, start + len(PLACEMENT) * self.placements)

    @property
    def bow(self) -> slice:
        """BOW of the board."""
        return slice(self.errors.stop, self.errors.stop + len(BOW))

    @property
    def poses(self) -> slice:
        """POSE of every board."""
        return slice(self.bow.stop, self.bow.stop + len(POSE) * self.boards)


class SpotData(NamedTuple):
    """N mean positions of spots."""

    laser: ArrayLike
    """(N,) index of the laser."""
    placement: ArrayLike
    """(N,) index of the placement."""


class CornerData(NamedTuple):
    """K corners of the board."""

    board: ArrayLike
    """(K,) index among the boards."""
    placement: ArrayLike
    """(K,) index of the placement."""
    printed_mm: ArrayLike
    """(K, 2) where the corner is in the board's file."""


def predict_cell(inputs: tuple[ArrayLike, ...], standoff_mm: ArrayLike) -> tuple[Array, Array]:
    """Pixel position (u, v) of one laser on the target of one placement; shapes broadcast.

    Args:
        inputs: the 17 numbers that it depends on: LENS, REFERENCE, RAY of the laser, PLACEMENT.
        standoff_mm: of the placement, by the ruler.
    """
    plane = _plane(inputs[_REFERENCE], inputs[_RAY.stop :], standoff_mm)
    return spot_on_plane(Lens(*inputs[_LENS]), Ray(*inputs[_RAY]), plane)


def predict_spots(values: Array, layout: Layout, spots: SpotData, standoff_mm: Array) -> Array:
    """(N, 2) pixel positions of spots.

    Args:
        values: (P,) parameters in the order of `Layout`.
        layout: what they are.
        spots: which laser on which placement.
        standoff_mm: standoffs of all placements by the ruler.
    """
    rays = values[layout.rays].reshape(layout.lasers, len(RAY))[spots.laser]
    errors = values[layout.errors].reshape(-1, len(PLACEMENT))[spots.placement]
    common = values[: _REFERENCE.stop]
    return jnp.stack(predict_cell((*common, *rays.T, *errors.T), standoff_mm[spots.placement]), axis=1)


def predict_corners(values: Array, layout: Layout, corners: CornerData, standoff_mm: Array) -> Array:
    """(K, 2) pixel positions of corners; arguments as those of `predict_spots`."""
    errors = values[layout.errors].reshape(-1, len(PLACEMENT))[corners.placement]
    plane = _plane(values[_REFERENCE], errors.T, standoff_mm[corners.placement])
    pose = Pose(plane, *values[layout.poses].reshape(-1, len(POSE))[corners.board].T)
    printed = jnp.asarray(corners.printed_mm).T
    bow, reach = values[layout.bow], printed / BOW_RADIUS_MM
    sag_mm = bow[0] * reach[0] ** 2 + bow[1] * reach[1] ** 2 + bow[2] * reach[0] * reach[1]
    across_mm, down_mm = printed * (1.0 + values[layout.rays.stop])
    x, y, z = point_on_board(pose, across_mm, down_mm, sag_mm)
    return jnp.stack(project(Lens(*values[_LENS]), x / z, y / z), axis=1)


def _plane(
    reference: tuple[ArrayLike, ...] | Array, errors: tuple[ArrayLike, ...] | Array, standoff_mm: ArrayLike
) -> Plane:
    """The target's plane, by REFERENCE and PLACEMENT."""
    offset_mm, ruler_scale = reference
    error_mm, slope_x, slope_y = errors
    return Plane(standoff_mm * (1.0 + ruler_scale) + error_mm + offset_mm, slope_x, slope_y)
