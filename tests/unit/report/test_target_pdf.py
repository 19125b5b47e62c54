"""The printed page, read as a PDF reader does: its box, its rectangles, its ruler."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from workbench.cli.target import write_target
from workbench.corners.board import find_board
from workbench.model.arrays import FloatArray
from workbench.model.board import Board
from workbench.model.errors import BadInputError
from workbench.report.target_pdf import ruler_mm, target_pdf

ROOT = Path(__file__).parents[3]
MM = 25.4 / 72
DPI = 200
NUMBER = r"(-?[\d.e+-]+)"


class Page:
    """What the file's one page draws, in millimetres from its top left corner."""

    def __init__(self, content: bytes) -> None:
        text = content.decode("latin-1")
        box = re.search(rf"/MediaBox \[0 0 {NUMBER} {NUMBER}\]", text)
        matrix = re.search(" ".join([NUMBER] * 6) + " cm", text)
        assert box
        assert matrix
        self.size_mm = np.array([float(n) for n in box.groups()]) * MM
        a, b, c, d, e, f = (float(n) for n in matrix.groups())
        assert b == c == 0
        self._scale, self._shift = np.array([a, d]), np.array([e, f])
        self.rectangles = np.array(self._numbers(text, 4, "re"))
        self.strokes = np.array([n[:4] for n in self._numbers(text, 2, "m", 2, "l S")])

    @staticmethod
    def _numbers(text: str, *parts: int | str) -> list[list[float]]:
        pattern = " ".join(" ".join([NUMBER] * p) if isinstance(p, int) else p for p in parts)
        return [[float(n) for n in m.groups()] for m in re.finditer(rf"(?m)^{pattern}$", text)]

    def on_page(self, points: FloatArray) -> FloatArray:
        """(n, 2) user space to mm; PDF counts y from the bottom."""
        at = (points * self._scale + self._shift) * MM
        return np.column_stack([at[:, 0], self.size_mm[1] - at[:, 1]])

    def drawn(self) -> NDArray[np.uint8]:
        """The rectangles at `DPI`, a pixel's tone being its white share."""
        width, height = np.ceil(self.size_mm / 25.4 * DPI).astype(int)
        ink = np.zeros((height, width))
        one, other = self.rectangles[:, :2], self.rectangles[:, :2] + self.rectangles[:, 2:]
        corners = np.stack([self.on_page(one), self.on_page(other)]) / 25.4 * DPI
        for low, high in zip(corners.min(axis=0), corners.max(axis=0), strict=True):
            first, last = np.floor(low).astype(int), np.ceil(high).astype(int)
            x, y = (
                np.diff(np.clip(np.arange(a, b + 1), lo, hi))
                for a, b, lo, hi in zip(first, last, low, high, strict=True)
            )
            ink[first[1] : last[1], first[0] : last[0]] += np.outer(y, x)
        return np.asarray(np.rint(255 * (1 - np.minimum(ink, 1))), np.uint8)


@pytest.mark.parametrize("board", [Board(), Board(columns=9, rows=3, square_mm=22.4, marker_mm=16.3)])
def test_the_board_is_found_on_the_page_at_its_true_size(board: Board) -> None:
    page = Page(target_pdf(board))
    np.testing.assert_allclose(page.size_mm, board.page_mm, atol=1e-3)
    # A lens blurs: edges sharper than a pixel do not say where in it they lie.
    seen = np.asarray(cv2.GaussianBlur(page.drawn(), (0, 0), 0.8), np.uint8)
    found = find_board([seen], board)
    assert len(found.ids) == len(board.corners_mm)
    # The centre of the top left pixel is (0, 0).
    measured_mm = (found.position_px + 0.5) / DPI * 25.4 - np.array(board.page_mm) / 2
    # Some hundredths of a pixel (8 bits, the kernel's end): 1e-5 of the board.
    np.testing.assert_allclose(measured_mm, board.corners_mm[found.ids], atol=0.03 / DPI * 25.4)


def test_the_ruler_has_its_length_and_lies_below_the_board() -> None:
    board = Board()
    page = Page(target_pdf(board))
    starts, ends = page.on_page(page.strokes[:, :2]), page.on_page(page.strokes[:, 2:])
    baseline = np.argmax(np.abs(ends - starts)[:, 0])
    assert ends[baseline, 0] - starts[baseline, 0] == pytest.approx(ruler_mm(board), abs=1e-3)
    ticks = np.delete(starts, baseline, axis=0)
    np.testing.assert_allclose(np.diff(np.sort(ticks[:, 0])), 1.0, atol=1e-3)
    assert len(ticks) == ruler_mm(board) + 1
    assert ticks[:, 1].min() > 105 + 12 + 80
    assert ends[:, 1].max() < 210 - 5


def test_the_cross_reference_table_points_to_the_objects() -> None:
    content = target_pdf(Board())
    start = int(content.rsplit(b"startxref\n", 1)[1].split()[0])
    offsets = [int(line[:10]) for line in content[start:].splitlines()[3:8]]
    assert content[start:].startswith(b"xref\n0 6\n")
    assert [content[at : at + 7] for at in offsets] == [b"%d 0 obj" % n for n in range(1, 6)]


def test_the_command_writes_the_rig_s_board(tmp_path: Path) -> None:
    rig = tmp_path / "rig.yaml"
    text = (ROOT / "rigs/thesis-emulated.yaml").read_text()
    rig.write_text(text.replace("\nbench:", "\nboard: {columns: 9}\n\nbench:"))
    assert "297 x 210 mm" in write_target(tmp_path / "board.pdf", rig)
    assert (tmp_path / "board.pdf").read_bytes() == target_pdf(Board(columns=9))
    assert "200 mm" in write_target(tmp_path / "board.pdf", None)
    with pytest.raises(BadInputError, match=r"board\.pdf"):
        write_target(tmp_path / "no" / "board.pdf", None)
