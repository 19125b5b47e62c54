"""Where parameters stand: the layout against the names of the parameters themselves."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.board_world import BoardWorld
from tests.support.rigs import FISHEYE_STANDOFFS_MM, STANDOFFS_MM, World, board_rig, fisheye_rig, thesis_rig
from workbench.calibration.data.boards import BoardView, with_placements
from workbench.calibration.data.observations import group
from workbench.calibration.estimation.fit import table_of
from workbench.calibration.estimation.problem import layout_of
from workbench.calibration.model.layout import Layout
from workbench.model.rig import Rig


@pytest.mark.parametrize(
    "rig", [thesis_rig(), fisheye_rig(), board_rig()], ids=["thesis", "fisheye", "board"]
)
def test_each_block_has_the_names_that_it_should(rig: Rig) -> None:
    world = World(rig, 1)
    standoffs = FISHEYE_STANDOFFS_MM if rig.camera.lens == "equidistant" else STANDOFFS_MM
    observations = world.observations(standoffs)
    boards: list[BoardView] = []
    if rig.rig == "thesis" and rig.camera.k1.sd == 0.1:
        on_boards, boards = BoardWorld(world).measure()
        observations = [*observations, *on_boards]
    cells, _ = group(observations, rig.laser_ids, rig.noise)
    cells = with_placements(cells, boards)
    layout = layout_of(rig, cells, boards)
    table = table_of(rig, cells.placements, boards)
    names = np.array([p.name for p in table.parameters])
    assert names[layout.lens].tolist() == list(rig.camera.lens_priors)
    tilt, drift = ["target_slope_x", "target_slope_y"], ["drift_u_px", "drift_v_px"]
    assert names[layout.reference].tolist() == ["offset_mm", "ruler_scale", *tilt, *drift]
    assert names[layout.bench_only].tolist() == ["ruler_scale", *tilt, *drift]
    assert names[layout.drift].tolist() == drift
    assert (names[layout.offset], names[layout.ruler_scale]) == ("offset_mm", "ruler_scale")
    assert names[layout.ray(2)].tolist() == [f"L3.{name}" for name in ("x_mm", "y_mm", "tx", "ty")]
    assert names[layout.own(1)].tolist() == [*names[layout.lens], *names[layout.ray(1)]]
    assert names[layout.print_scale].tolist() == ["print_scale"] * bool(boards)
    assert (np.flatnonzero(table.is_sensor) == np.arange(layout.sensor.stop)).all()
    keys = [p.key for p in cells.placements]
    assert names[layout.errors][::3].tolist() == [f"{key}.error_mm" for key in keys]
    if boards:
        assert names[layout.bow].tolist() == ["bow_x_mm", "bow_y_mm", "bow_xy_mm"]
        assert names[layout.poses][2::3].tolist() == [f"{b.placement.key}.board_roll_rad" for b in boards]
        assert layout.poses.stop == len(names)
    else:
        assert layout.errors.stop == len(names)


def test_one_laser_and_one_placement_are_the_inputs_of_a_cell() -> None:
    for cell, size in ((Layout("plumb_bob"), 8), (Layout("equidistant"), 7)):
        assert (cell.lens.stop, cell.common.stop, cell.errors.stop) == (size, size + 6, size + 13)
        assert cell.ray(0) == cell.rays
        assert cell.sensor.stop == cell.errors.start
