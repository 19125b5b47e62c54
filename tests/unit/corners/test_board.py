"""Corners of the emulated board against where its hidden truth puts them, and what finding it refuses."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from tests.support.drawn_boards import KnownBoard, draw, to_picture
from workbench.corners.board import BoardCorners, find_board
from workbench.corners.subpixel import FLOOR_SD_PX
from workbench.emulator import open_bench
from workbench.emulator.board import BoardSurface
from workbench.model.arrays import FloatArray
from workbench.model.board import Board, sag_mm
from workbench.model.errors import BadInputError
from workbench.model.known_board import AprilGrid, CharucoBoard, Chessboard
from workbench.model.rig import Rig, load_rig
from workbench.model.target import BoardTarget, Placement

ROOT = Path(__file__).parents[3]
SEEDS = (2001, 7, 42)
FRAMES = 16
PLACINGS = ((240.0, 0.0, 0.0), (300.0, 35.0, 0.0), (430.0, 0.0, -20.0))
NOISELESS: dict[str, Any] = {
    "sensor": {"read_noise_e": 0.0, "hot_pixels": 0, "full_well_e": 1e9, "quantum_efficiency": 1.0},
    "ambient": {"level_e_per_s": 2e10, "flicker_depth": 0.0},
}

CHESSBOARD = Chessboard(kind="chessboard", corners=(9, 6), square_mm=25.0)
CHARUCO = CharucoBoard(
    kind="charuco", squares=(8, 6), square_mm=30.0, marker_mm=22.0, dictionary="DICT_5X5_50", first_marker=3
)
LEGACY = CHARUCO.model_copy(update={"legacy_pattern": True})
APRILGRID = AprilGrid(kind="aprilgrid", tags=(5, 4), tag_mm=40.0, spacing=0.3)
KNOWN = (CHESSBOARD, CHARUCO, LEGACY, APRILGRID)


def rig_of(seed: int, **emulator: Any) -> Rig:
    rig = load_rig(ROOT / "rigs/thesis-emulated.yaml")
    camera = rig.camera.model_copy(update={"bits": 16 if emulator else 8})
    return rig.model_copy(update={"emulator": {"seed": seed, **emulator}, "camera": camera})


@dataclass(frozen=True)
class Seen:
    frames: list[NDArray[Any]]
    true_px: FloatArray
    """(K, 2) of every corner of the board, in the frame or not."""


def look(rig: Rig, folder: Path, standoff_mm: float, yaw_deg: float, pitch_deg: float, count: int) -> Seen:
    with open_bench(rig, folder / "session") as bench:
        target = BoardTarget(yaw_deg=yaw_deg, pitch_deg=pitch_deg)
        bench.target.place(Placement(key="P", standoff_mm=standoff_mm, target=target))
        frames = []
        for number in range(count):
            bench.mark(f"P/board/{number}")
            frames.append(bench.camera.grab_ambient().image)
        board = bench.target._surfaces[0][0]
        assert isinstance(board, BoardSurface)
        printed = rig.board.corners_mm
        sag = sag_mm(board.bow_mm, printed)[:, None] * board.axes[2]
        points = board.origin_mm + board.scale * printed @ board.axes[:2] + sag
        return Seen(frames, bench.target._lens().project(points))


def errors(found: BoardCorners, seen: Seen) -> FloatArray:
    return found.position_px - seen.true_px[found.ids]


@pytest.mark.thorough
def test_errors_are_as_large_as_stated(tmp_path: Path) -> None:
    scores: list[float] = []
    for n, seed in enumerate(SEEDS):
        rig = rig_of(seed)
        seen = look(rig, tmp_path / f"{seed}", *PLACINGS[n], FRAMES)
        found = find_board(seen.frames, rig.board)
        assert len(found.ids) > 40
        assert np.median(found.sd_px) < 0.025
        scores += (errors(found, seen) / found.sd_px).ravel().tolist()
    z = np.array(scores)
    # Squares of n standard normals have the mean 1 +- sqrt(2 / n); four of these, and 10 % for a deviation
    # that is estimated from the same pixels.
    assert np.mean(z**2) == pytest.approx(1.0, abs=0.1 + 4 * np.sqrt(2 / len(z)))
    assert np.abs(z).max() < 5.0


@pytest.mark.parametrize(("seed", "placing"), list(zip(SEEDS, PLACINGS, strict=True)))
def test_without_noise_what_is_left_is_the_stated_floor(
    seed: int, placing: tuple[float, float, float], tmp_path: Path
) -> None:
    rig = rig_of(seed, **NOISELESS)
    seen = look(rig, tmp_path, *placing, 1)
    error = errors(find_board(seen.frames, rig.board), seen)
    assert np.sqrt(np.mean(error**2)) < FLOOR_SD_PX
    assert np.abs(error.mean(axis=0)).max() < FLOOR_SD_PX / 2


def test_a_board_cut_by_the_frame_and_half_covered(tmp_path: Path) -> None:
    rig = rig_of(7)
    seen = look(rig, tmp_path, 180.0, 0.0, 0.0, FRAMES)
    whole = find_board(seen.frames, rig.board)
    assert len(whole.ids) < len(rig.board.corners_mm)
    covered = [frame.copy() for frame in seen.frames]
    for frame in covered:
        frame[:, :200] = 12
    part = find_board(covered, rig.board)
    assert 12 <= len(part.ids) < len(whole.ids)
    for found in (whole, part):
        assert np.abs(errors(found, seen) / found.sd_px).max() < 5.0


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> Seen:
    return look(rig_of(42), tmp_path_factory.mktemp("refused"), 300.0, 0.0, 0.0, 4)


class TestRefusals:
    """Each by a BadInputError that says what was seen; nothing else escapes."""

    @pytest.mark.parametrize("tone", [0, 128, 255])
    def test_an_empty_frame(self, tone: int) -> None:
        with pytest.raises(BadInputError, match="at least 12 corners of the board, got 0"):
            find_board([np.full((480, 640), tone, np.uint8)], Board())

    def test_noise(self) -> None:
        noise = np.random.default_rng(1).integers(0, 255, (480, 640)).astype(np.uint8)
        with pytest.raises(BadInputError, match="corners"):
            find_board([noise], Board())

    def test_too_far(self, tmp_path: Path) -> None:
        far = look(rig_of(42), tmp_path, 650.0, 0.0, 0.0, FRAMES)
        with pytest.raises(BadInputError, match="corners of the board"):
            find_board(far.frames, Board())

    def test_another_board(self, seen: Seen) -> None:
        with pytest.raises(BadInputError, match="corners of the board"):
            find_board(seen.frames, Board(dictionary="DICT_5X5_100"))

    def test_a_mirrored_image(self, seen: Seen) -> None:
        with pytest.raises(BadInputError, match="corners of the board"):
            find_board([frame[:, ::-1].copy() for frame in seen.frames], Board())

    def test_out_of_focus(self, seen: Seen) -> None:
        blurred = [np.asarray(cv2.GaussianBlur(frame, (0, 0), 8.0), np.uint8) for frame in seen.frames]
        with pytest.raises(BadInputError, match="corners of the board"):
            find_board(blurred, Board())

    def test_no_frames_and_frames_of_two_sizes(self, seen: Seen) -> None:
        with pytest.raises(BadInputError, match="at least one frame"):
            find_board([], Board())
        with pytest.raises(BadInputError, match="one size"):
            find_board([seen.frames[0], seen.frames[1][:-1]], Board())


def test_a_hot_pixel_moves_no_corner(tmp_path: Path) -> None:
    rig = rig_of(2001)
    seen = look(rig, tmp_path, 300.0, 0.0, 0.0, FRAMES)
    before = find_board(seen.frames, rig.board)
    struck = [frame.copy() for frame in seen.frames]
    for u, v in np.rint(before.position_px[::4] + np.array([2.0, 1.0])).astype(int):
        for frame in struck:
            frame[v, u] = 250
    after = find_board(struck, rig.board)
    common, one, other = np.intersect1d(before.ids, after.ids, return_indices=True)
    assert len(common) == len(before.ids)
    moved = after.position_px[other] - before.position_px[one]
    # A pixel less of some 140: the corner moves by a part of its own deviation.
    assert np.abs(moved / before.sd_px[one]).max() < 1.0


@pytest.mark.long_cases
@pytest.mark.parametrize("view", [0, 1])
@pytest.mark.parametrize("board", KNOWN, ids=lambda board: board.kind)
def test_boards_of_others_are_found_where_they_are(board: KnownBoard, view: int) -> None:
    found = find_board([draw(board, view, noise_dn=2.0, seed=seed) for seed in (1, 2)], board)
    assert len(found.ids) > 0.9 * len(board.corners_mm)
    true_px = cv2.perspectiveTransform(board.corners_mm[None], to_picture(board, view))[0]
    z = (found.position_px - true_px[found.ids]) / found.sd_px
    if isinstance(board, Chessboard):  # it looks the same after half a turn
        turned = (found.position_px - true_px[::-1][found.ids]) / found.sd_px
        z = min(z, turned, key=lambda one: float(np.abs(one).max()))
    # As `test_errors_are_as_large_as_stated`; drawn in steps of a quarter pixel, which adds some.
    assert np.mean(z**2) == pytest.approx(1.0, abs=0.3 + 4 * np.sqrt(2 / z.size))


def test_a_view_that_shows_half_a_chessboard_is_refused() -> None:
    picture = draw(CHESSBOARD, 0, noise_dn=2.0)
    picture[:, :300] = 128
    with pytest.raises(BadInputError, match="whole board"):
        find_board([picture], CHESSBOARD)


def test_half_an_aprilgrid_and_half_a_charuco_board_are_found() -> None:
    for board in (CHARUCO, APRILGRID):
        picture = draw(board, 0, noise_dn=2.0)
        picture[:, :300] = 128
        found = find_board([picture], board)
        assert 0.3 < len(found.ids) / len(board.corners_mm) < 0.7


def test_an_aprilgrid_numbered_from_the_top_row_is_found() -> None:
    pictures = draw(APRILGRID, 0, 2.0), draw(APRILGRID, 0, 2.0, from_top=True)
    below, above = (find_board([picture], APRILGRID) for picture in pictures)
    assert len(below.ids) == len(above.ids)
    order = np.argsort(below.ids), np.argsort(above.ids)
    np.testing.assert_allclose(below.position_px[order[0]], above.position_px[order[1]], atol=0.2)


def test_an_aprilgrid_upside_down_is_found() -> None:
    turned = np.ascontiguousarray(draw(APRILGRID, 0, noise_dn=2.0)[::-1, ::-1], np.uint8)
    upright, over = (find_board([picture], APRILGRID) for picture in (draw(APRILGRID, 0, 2.0), turned))
    np.testing.assert_array_equal(np.sort(over.ids), np.sort(upright.ids))
    by_id = dict(zip(over.ids.tolist(), over.position_px, strict=True))
    for number, place in zip(upright.ids.tolist(), upright.position_px, strict=True):
        assert by_id[number] == pytest.approx([639 - place[0], 479 - place[1]], abs=0.2)
