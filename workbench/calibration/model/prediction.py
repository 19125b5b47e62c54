"""Predicted positions of spots and of the board's corners: the forward model that every fit shares."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from workbench.calibration.model.layout import Layout
from workbench.calibration.model.parameters import PLACEMENT, POSE, STEP
from workbench.model.board import BOW_RADIUS_MM
from workbench.model.lens import LensName
from workbench.optics.board import Pose, point_on_board
from workbench.optics.rays import RAY, Plane, Ray, spot_on_plane


class SpotData(NamedTuple):
    """N mean positions of spots."""

    laser: ArrayLike
    """(N,) index of the laser."""
    placement: ArrayLike
    """(N,) index of the placement."""
    time: ArrayLike
    """(N,) running time at its capture, from -0.5 (first capture of the session) to 0.5 (last)."""
    parts: ArrayLike
    """(N, P) share of each part of the session."""


class CornerData(NamedTuple):
    """K corners of the board."""

    board: ArrayLike
    """(K,) index among the boards."""
    placement: ArrayLike
    """(K,) index of the placement."""
    printed_mm: ArrayLike
    """(K, 2) nominal position of the corner on the board."""
    time: ArrayLike
    """(K,) as of `SpotData`."""
    parts: ArrayLike
    """(K, P) as of `SpotData`."""


def predict_cell(
    lens_name: LensName, inputs: tuple[ArrayLike, ...], standoff_mm: ArrayLike, time: ArrayLike = 0.0
) -> tuple[Array, Array]:
    """Pixel position (u, v) of one laser on the target of one placement; shapes broadcast.

    Args:
        lens_name: lens model.
        inputs: parameters of one laser and one placement, in the order of `Layout`.
        standoff_mm: of the placement, by the ruler.
        time: when it was captured, see `SpotData`.
    """
    cell = Layout(lens_name)
    plane = _plane(inputs[cell.reference], inputs[cell.errors], standoff_mm)
    u, v = spot_on_plane(cell.model, inputs[cell.lens], Ray(*inputs[cell.rays]), plane)
    drift_u, drift_v = inputs[cell.drift]
    return u + drift_u * time, v + drift_v * time


def predict_spots(values: Array, layout: Layout, spots: SpotData, standoff_mm: Array) -> Array:
    """(N, 2) pixel positions of spots.

    Args:
        values: (P,) parameters in the order of `Layout`.
        layout: their layout.
        spots: laser and placement of each spot.
        standoff_mm: (J,) standoffs of all placements by the ruler.
    """
    rays = values[layout.rays].reshape(layout.lasers, len(RAY))[spots.laser]
    errors = values[layout.errors].reshape(-1, len(PLACEMENT))[spots.placement]
    inputs = (*values[layout.common], *rays.T, *errors.T)
    standoff_mm = standoff_mm[spots.placement]
    seen = jnp.stack(predict_cell(layout.lens_name, inputs, standoff_mm, spots.time), axis=1)
    return seen + _offsets(values, layout, spots.parts) if layout.parts > 1 else seen


def predict_corners(values: Array, layout: Layout, corners: CornerData, standoff_mm: Array) -> Array:
    """(K, 2) pixel positions of corners; arguments as those of `predict_spots`."""
    errors = values[layout.errors].reshape(-1, len(PLACEMENT))[corners.placement]
    plane = _plane(values[layout.reference], errors.T, standoff_mm[corners.placement])
    pose = Pose(plane, *values[layout.poses].reshape(-1, len(POSE))[corners.board].T)
    printed = jnp.asarray(corners.printed_mm).T
    bow, reach = values[layout.bow], printed / BOW_RADIUS_MM
    sag_mm = bow[0] * reach[0] ** 2 + bow[1] * reach[1] ** 2 + bow[2] * reach[0] * reach[1]
    across_mm, down_mm = printed * (1.0 + values[layout.print_scale.start])
    x, y, z = point_on_board(pose, across_mm, down_mm, sag_mm)
    seen = jnp.stack(layout.model.project(values[layout.lens], x / z, y / z), axis=1)
    seen = seen + values[layout.drift] * jnp.asarray(corners.time)[:, None]
    return seen + _offsets(values, layout, corners.parts) if layout.parts > 1 else seen


def _offsets(values: Array, layout: Layout, parts: ArrayLike) -> Array:
    """(N, 2) offsets of the image by the steps between the parts of the session, by shares (N, P)."""
    steps = values[layout.steps].reshape(-1, len(STEP))
    return jnp.asarray(parts) @ layout.offsets_by_step @ steps


def _plane(
    reference: tuple[ArrayLike, ...] | Array, errors: tuple[ArrayLike, ...] | Array, standoff_mm: ArrayLike
) -> Plane:
    """Plane of the target in the camera frame, from REFERENCE and PLACEMENT."""
    offset_mm, ruler_scale, common_x, common_y, *_ = reference
    error_mm, slope_x, slope_y = errors
    depth_mm = standoff_mm * (1.0 + ruler_scale) + error_mm + offset_mm
    return Plane(depth_mm, _sum_of_tilts(slope_x, common_x), _sum_of_tilts(slope_y, common_y))


def _sum_of_tilts(a: ArrayLike, b: ArrayLike) -> Array:
    """Tangent of the sum of two angles given by their tangents."""
    return jnp.asarray(jnp.add(a, b) / (1.0 - jnp.multiply(a, b)))
