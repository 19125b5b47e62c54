"""The board as a target of the virtual bench: what beams meet on it, and what of it is drawn."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml as pyyaml

from tests.support.ideal import ideal_rig, laser, scene_of
from workbench.emulator.board import BoardSurface
from workbench.emulator.scene import BenchScene
from workbench.emulator.spec import SurfaceSpec
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig
from workbench.model.target import BoardTarget, FlatTarget, Placement, TargetShape

NARROW: dict[str, Any] = {"beam": {"exit_diameter_mm": 0.5, "divergence_mrad": 0.0, "speckle_contrast": 0.0}}


def placed(rig: Rig, folder: Path, target: TargetShape, key: str = "P") -> BenchScene:
    scene = scene_of(rig, folder)
    scene.place(Placement(key=key, standoff_mm=300.0, target=target))
    return scene


def power(scene: BenchScene, laser_id: str) -> float:
    return sum(float(spot.rate.sum(dtype=np.float64)) for spot in scene.spots(laser_id))


def board_of(scene: BenchScene) -> BoardSurface:
    board = scene._surfaces[0][0]
    assert isinstance(board, BoardSurface)
    return board


def test_spots_take_the_albedo_of_what_they_hit(tmp_path: Path) -> None:
    # Seen from the middle between the lasers, where a hand puts the band: ink at 22 mm, paper at 0 mm, and
    # 400 mm off nothing. A hand is 2 mm off and the square 20 mm wide.
    rig = ideal_rig(
        laser("ink", 0.0, 22.0),
        laser("other", 0.0, -22.0),
        laser("left", -400.0),
        laser("right", 400.0),
        **NARROW,
    )
    board, flat = (placed(rig, tmp_path / n, t) for n, t in (("b", BoardTarget()), ("f", FlatTarget())))
    tone = board_of(board).shade(np.array([[0.0, 22.0, 300.0]]))[0]
    surface = SurfaceSpec()
    assert tone == pytest.approx(surface.ink_albedo / surface.albedo)
    assert power(board, "ink") == pytest.approx(tone * power(flat, "ink"), rel=1e-3)
    assert board.spots("left") == []


def test_on_the_band_a_spot_is_that_of_a_flat(tmp_path: Path) -> None:
    rig = ideal_rig(laser("L1", -60.0), laser("L2", 60.0))
    board, flat = (placed(rig, tmp_path / n, t) for n, t in (("b", BoardTarget()), ("f", FlatTarget())))
    for name in rig.laser_ids:
        (one,), (other,) = board.spots(name), flat.spots(name)
        np.testing.assert_allclose(one.rate, other.rate, rtol=1e-3, atol=1e-4 * other.rate.max())


def test_flats_show_nothing_in_room_light_and_boards_their_print(tmp_path: Path) -> None:
    rig = ideal_rig(laser("L1", -60.0), laser("L2", 60.0))
    assert placed(rig, tmp_path / "f", FlatTarget()).picture() is None
    picture = placed(rig, tmp_path / "b", BoardTarget()).picture()
    assert picture is not None
    ink = SurfaceSpec().ink_albedo / SurfaceSpec().albedo
    assert (float(picture.min()), float(picture.max())) == pytest.approx((ink, 1.0), abs=1e-5)
    # Half of the blocks' squares are black, and in the other half 9/16 belongs to markers.
    blocks = 260.0 * 160.0 * (533.3 / 300.0) ** 2
    assert 0.5 < (1 - picture).sum() / (1 - ink) / blocks < 0.5 + 0.5 * 9 / 16


@pytest.mark.parametrize("roll_deg", [0.0, 90.0])
def test_axes_are_orthonormal_on_the_plane_that_a_flat_would_have(roll_deg: float, tmp_path: Path) -> None:
    target = BoardTarget(yaw_deg=30.0, pitch_deg=-20.0, roll_deg=roll_deg)
    board = board_of(placed(ideal_rig(), tmp_path, target))
    np.testing.assert_allclose(board.axes @ board.axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(board.axes) == pytest.approx(1.0)
    slopes = np.tan(np.radians([30.0, -20.0]))
    for point in (
        board.origin_mm,
        board.origin_mm + 50 * board.axes[0],
        board.origin_mm - 30 * board.axes[1],
    ):
        assert point[2] == pytest.approx(300.0 + slopes @ point[:2], abs=1e-9)
    # Drawn with a deviation of one degree; the band runs along the board's x.
    assert np.degrees(np.arctan2(board.axes[0, 1], board.axes[0, 0])) == pytest.approx(roll_deg, abs=25.0)


def test_where_it_stands_is_a_matter_of_the_key_and_in_the_truth(tmp_path: Path) -> None:
    one, again, other = (
        board_of(placed(ideal_rig(), tmp_path / str(n), BoardTarget(), key)) for n, key in enumerate("PPQ")
    )
    np.testing.assert_array_equal(one.origin_mm, again.origin_mm)
    assert not np.array_equal(one.origin_mm, other.origin_mm)
    written = pyyaml.safe_load((tmp_path / "0" / "truth.yaml").read_text())
    assert (written["placements"]["P"]["x_mm"], written["print_scale"]) == pytest.approx(
        (one.origin_mm[0], one.scale - 1)
    )


def test_a_board_edge_on_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"board target: .*90 deg"):
        placed(ideal_rig(), tmp_path, BoardTarget(yaw_deg=90.0))
