"""Predicted spots and corners against linear algebra and OpenCV's lenses."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.support.rigs import World, board_rig, fisheye_rig, opencv_pixels, thesis_rig
from workbench.calibration.model.layout import Layout
from workbench.calibration.model.prediction import (
    CornerData,
    SpotData,
    predict_cell,
    predict_corners,
    predict_spots,
)
from workbench.model.prior import Prior
from workbench.model.rig import Rig

LASER, PLACEMENT = np.array([0, 3, 1, 2]), np.array([0, 1, 1, 0])
STANDOFF_MM = np.array([150.0, 900.0])
TIME = np.array([-0.5, 0.1, 0.3, 0.5])
PARTS = np.array([[1.0, 0.0], [0.75, 0.25], [0.0, 1.0], [0.0, 1.0]])
"""Share of the repeats before and after an interruption."""
STEP_PX = np.array([0.6, -0.4])
ERRORS = np.array([[0.4, 0.02, -0.03], [-0.7, -0.01, 0.04]])


def drifting(rig: Rig) -> Rig:
    spread = Prior(value=0.2, sd=1.0)
    return rig.model_copy(
        update={"bench": rig.bench.model_copy(update={"drift_u_px": spread, "drift_v_px": spread})}
    )


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("rig", [drifting(thesis_rig()), fisheye_rig()], ids=["plumb_bob", "equidistant"])
def test_spots_lie_where_opencv_puts_the_ray_s_point_on_the_plane(rig: Rig, seed: int) -> None:
    world = World(rig, seed)
    layout = Layout(rig.camera.lens, 4, 2, parts=2)
    values = jnp.array([*world.values.values(), *ERRORS.ravel(), *STEP_PX])
    spots = SpotData(LASER, PLACEMENT, TIME, PARTS)
    found = predict_spots(values, layout, spots, jnp.asarray(STANDOFF_MM))
    for n, (laser, placement) in enumerate(zip(LASER, PLACEMENT, strict=True)):
        error_mm, *slopes = ERRORS[placement]
        z0 = STANDOFF_MM[placement] * (1 + world.values["ruler_scale"]) + world.values["offset_mm"]
        turn = np.arctan(slopes) + world.common_tilt
        expected = world.pixel(rig.laser_ids[laser], z0 + error_mm, *turn)
        expected = expected + TIME[n] * np.array([world.values["drift_u_px"], world.values["drift_v_px"]])
        expected = expected + STEP_PX * (PARTS[n, 1] - 0.5)
        np.testing.assert_allclose(found[n], expected, rtol=1e-9)


def test_one_cell_is_the_spot_of_its_inputs() -> None:
    world = World(thesis_rig(), 1)
    names = list(world.values)
    shared = [world.values[name] for name in names[:14]]
    ray = [world.values[f"L3.{name}"] for name in ("x_mm", "y_mm", "tx", "ty")]
    found = predict_cell("plumb_bob", (*shared, *ray, 0.0, 0.0, 0.0), np.array([200.0, 3000.0]))
    for n, standoff in enumerate((200.0, 3000.0)):
        z0 = standoff * (1 + world.values["ruler_scale"]) + world.values["offset_mm"]
        expected = world.pixel("L3", z0, *world.common_tilt)
        np.testing.assert_allclose([found[0][n], found[1][n]], expected, rtol=1e-9)


@pytest.mark.parametrize("roll_rad", [0.0, 0.3, -1.5])
def test_corners_lie_where_a_turned_and_shifted_board_has_them(roll_rad: float) -> None:
    """A print 0.2 % too large, bent by some tenths of a millimetre, on a tilted plane; by rotations."""
    world = World(drifting(board_rig()), 2)
    layout = Layout("plumb_bob", 4, 2, 1, parts=2)
    scale, bow, (x_mm, y_mm) = 0.002, np.array([0.3, -0.2, 0.1]), (5.0, -8.0)
    values = [*world.values.values(), scale, *ERRORS.ravel(), *bow, x_mm, y_mm, roll_rad, *STEP_PX]
    assert len(values) == layout.steps.stop
    printed = np.array([[0.0, 0.0], [100.0, 0.0], [-60.0, 70.0]])
    corners = CornerData(
        np.zeros(3, int), np.ones(3, int), printed, np.full(3, 0.3), np.tile(PARTS[1], (3, 1))
    )
    found = predict_corners(jnp.array(values), layout, corners, jnp.asarray(STANDOFF_MM))
    error_mm = ERRORS[1, 0]
    slope_x, slope_y = np.tan(np.arctan(ERRORS[1, 1:]) + world.common_tilt)
    z0 = STANDOFF_MM[1] * (1 + world.values["ruler_scale"]) + error_mm + world.values["offset_mm"]
    normal = np.array([-slope_x, -slope_y, 1.0])
    right = np.array([1.0, 0.0, slope_x])
    axes = np.stack([right / np.hypot(1, slope_x), np.cross(normal, right), normal])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    turn = Rotation.from_euler("z", roll_rad).as_matrix()
    reach = printed / 100.0
    sag = bow[0] * reach[:, 0] ** 2 + bow[1] * reach[:, 1] ** 2 + bow[2] * reach[:, 0] * reach[:, 1]
    own = np.column_stack([printed * (1 + scale), sag])
    middle = np.array([x_mm, y_mm, z0 + slope_x * x_mm + slope_y * y_mm])
    points = middle + (own @ turn.T) @ axes
    camera = [world.values[name] for name in board_rig().camera.lens_priors]
    shift = 0.3 * np.array([world.values["drift_u_px"], world.values["drift_v_px"]]) - 0.25 * STEP_PX
    np.testing.assert_allclose(found, opencv_pixels("plumb_bob", camera, points) + shift, rtol=1e-9)
