"""`workbench target`."""

from __future__ import annotations

from pathlib import Path

from workbench.model.board import Board
from workbench.model.rig import load_rig
from workbench.report.board_page import board_page, ruler_mm
from workbench.session.files import write_output


def write_target(pdf: Path, rig: Path | None) -> str:
    """Write the page of the board; returns instructions for printing it.

    Raises:
        BadInputError: the rig file is wrong, or the file cannot be written.
    """
    board = Board() if rig is None else load_rig(rig, camera_alone=True).banded_board
    write_output(pdf, board_page(board))
    width, height = board.page_mm
    page = f"{pdf}: {width:g} x {height:g} mm"
    return f"{page}. Print it at 100 % and measure its {ruler_mm(board)} mm ruler"
