"""The printed page as it is printed: rasterised at a known resolution, and measured."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pypdfium2
import pytest
from numpy.typing import NDArray

from workbench.cli.target import write_target
from workbench.corners.board import find_board
from workbench.model.arrays import FloatArray
from workbench.model.board import Board
from workbench.model.errors import BadInputError
from workbench.report.board_page import board_page, ruler_mm

ROOT = Path(__file__).parents[3]
DPI = 300
MM_PER_INCH = 25.4
MM = MM_PER_INCH / DPI
BOARDS = [
    Board(),
    Board(columns=9, rows=3, square_mm=22.4, marker_mm=16.3),
    Board(columns=18, rows=6, page_mm=(420.0, 297.0), dictionary="DICT_5X5_250"),
]
TRUE_SIZE_MM = 0.1


def opened(board: Board) -> pypdfium2.PdfPage:
    (page,) = pypdfium2.PdfDocument(board_page(board))
    return page


def printed(board: Board) -> NDArray[np.uint8]:
    """The page at `DPI`, 0 black."""
    return np.asarray(opened(board).render(scale=DPI / 72, grayscale=True).to_numpy(), np.uint8)


def pixels(board: Board, x_mm: float, y_mm: float) -> tuple[int, int]:
    """Column and row of a place in the board's frame."""
    width, height = board.page_mm
    return round((x_mm + width / 2) / MM), round((y_mm + height / 2) / MM)


def edges_mm(tones: NDArray[np.uint8]) -> FloatArray:
    """Where a row of pixels changes between black and white, mm from its start, to a part of a pixel."""
    light = tones.astype(float) / 255
    at = np.flatnonzero((light[:-1] < 0.5) != (light[1:] < 0.5))
    return np.asarray((at + 0.5 + (0.5 - light[at]) / (light[at + 1] - light[at])) * MM)


@pytest.mark.parametrize("board", BOARDS)
def test_the_page_has_its_size(board: Board) -> None:
    size_mm = np.array(opened(board).get_size()) / 72 * MM_PER_INCH
    np.testing.assert_allclose(size_mm, board.page_mm, atol=1e-3)


@pytest.mark.parametrize("board", BOARDS)
def test_squares_have_their_size_and_place(board: Board) -> None:
    """Along the upper edge of the upper block's first row: squares alternate, and no marker is near."""
    page = printed(board)
    _, row = pixels(board, 0.0, board.block_tops_mm[0] + (board.square_mm - board.marker_mm) / 4)
    expected = board.left_mm + board.square_mm * np.arange(board.columns + board.columns % 2)
    np.testing.assert_allclose(edges_mm(page[row]) - board.page_mm[0] / 2, expected, atol=TRUE_SIZE_MM)
    column, _ = pixels(board, board.left_mm + (board.square_mm - board.marker_mm) / 4, 0.0)
    tops = [top - 0.5 for top in board.block_tops_mm]
    first, last = (pixels(board, 0.0, top)[1] for top in tops)
    down = edges_mm(page[first:last, column]) + first * MM - board.page_mm[1] / 2
    expected = board.block_tops_mm[0] + board.square_mm * np.arange(board.rows + board.rows % 2)
    np.testing.assert_allclose(down, expected, atol=TRUE_SIZE_MM)


@pytest.mark.long_cases
@pytest.mark.parametrize("board", BOARDS)
def test_the_board_is_found_on_the_page_at_its_true_size(board: Board) -> None:
    # A lens blurs: edges sharper than a pixel do not say where in it they lie.
    seen = np.asarray(cv2.GaussianBlur(printed(board), (0, 0), 0.8), np.uint8)
    found = find_board([seen], board)
    assert len(found.ids) == len(board.corners_mm)
    # The centre of the top left pixel is (0, 0).
    measured_mm = (found.position_px + 0.5) * MM - np.array(board.page_mm) / 2
    np.testing.assert_allclose(measured_mm, board.corners_mm[found.ids], atol=TRUE_SIZE_MM)
    error_mm = measured_mm - board.corners_mm[found.ids]
    # The rasteriser's pixels round a page to whole ones: a common shift, and at most one pixel of scale.
    assert np.ptp(error_mm, axis=0).max() < MM


@pytest.mark.parametrize("board", BOARDS)
def test_the_ruler_has_its_length_and_lies_below_the_board(board: Board) -> None:
    page = printed(board)
    half = ruler_mm(board) / 2
    below = board.block_tops_mm[1] + board.rows * board.square_mm
    ruler_top = board.page_mm[1] / 2 - 11.0
    assert ruler_top > below
    _, row = pixels(board, 0.0, ruler_top + 0.6)
    ticks = edges_mm(page[row]).reshape(-1, 2).mean(axis=1) - board.page_mm[0] / 2
    assert len(ticks) == ruler_mm(board) + 1
    np.testing.assert_allclose(ticks, np.arange(ruler_mm(board) + 1) - half, atol=TRUE_SIZE_MM)
    assert (ticks[-1] - ticks[0]) == pytest.approx(ruler_mm(board), abs=TRUE_SIZE_MM)


@pytest.mark.parametrize("board", BOARDS)
def test_the_margins_are_free_and_the_words_lie_above_the_board(board: Board) -> None:
    page = printed(board)
    margin = int(4.5 / MM)
    for edge in (page[:margin], page[-margin:], page[:, :margin], page[:, -margin:]):
        assert edge.min() == 255
    _, top = pixels(board, 0.0, board.block_tops_mm[0])
    between = page[top - 3 : top - 1]
    assert between.min() == 255, "letters touch no square"


def test_the_words_say_how_to_print_and_what_to_measure() -> None:
    text = opened(Board()).get_textpage().get_text_bounded()
    assert "Print at 100 %" in text
    assert "print_scale" in text
    assert "200 mm" in text


def test_viewers_are_asked_not_to_fit_the_page() -> None:
    """As a reader finds it: by the trailer and the cross-reference table."""
    content = board_page(Board())
    table = content[int(content.rsplit(b"startxref\n", 1)[1].split()[0]) :].splitlines()
    assert table[0] == b"xref"
    root = int(content.rsplit(b"/Root ", 1)[1].split()[0])
    catalogue = content[int(table[2 + root][:10]) :].split(b"endobj")[0]
    assert catalogue.startswith(b"%d 0 obj" % root)
    assert b"/PrintScaling /None" in catalogue


def test_the_same_board_gives_the_same_bytes() -> None:
    assert board_page(Board()) == board_page(Board())
    assert b"CreationDate" not in board_page(Board())


def test_the_command_writes_the_rig_s_board(tmp_path: Path) -> None:
    rig = tmp_path / "rig.yaml"
    text = (ROOT / "rigs/thesis-emulated.yaml").read_text()
    rig.write_text(text.replace("\nbench:", "\nboard: {columns: 9}\n\nbench:"))
    assert "297 x 210 mm" in write_target(tmp_path / "board.pdf", rig)
    assert (tmp_path / "board.pdf").read_bytes() == board_page(Board(columns=9))
    assert "200 mm" in write_target(tmp_path / "board.pdf", None)
    with pytest.raises(BadInputError, match=r"board\.pdf"):
        write_target(tmp_path / "no" / "board.pdf", None)
