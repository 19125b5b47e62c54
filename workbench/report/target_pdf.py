"""The printed board as a PDF page of true size: filled rectangles, a ruler to check them with, two lines.

Written by hand: rectangles and Helvetica need little of PDF 1.6 (ISO 32000-1, sections 7.5 and 8.5).
"""

from __future__ import annotations

from collections.abc import Iterable

from workbench.model.board import BELOW_MM, PAGE_MARGIN_MM, Board

POINTS_PER_MM = 72 / 25.4
TEXT_MM = 3.0
LINE_MM = 4.0
RULER_STEP_MM = 10
LONGEST_RULER_MM = 200
HAIRLINE_MM = 0.15


def ruler_mm(board: Board) -> int:
    """Length of the printed ruler: whole centimetres, no longer than the blocks are wide."""
    width = int(board.columns * board.square_mm)
    return min(LONGEST_RULER_MM, width - width % RULER_STEP_MM)


def target_pdf(board: Board) -> bytes:
    """One page of `board.page_mm`; the board's frame has its origin in the middle of the page."""
    width, height = board.page_mm
    marks = [
        f"{POINTS_PER_MM:.9f} 0 0 {-POINTS_PER_MM:.9f} {width / 2 * POINTS_PER_MM:.6f}"
        f" {height / 2 * POINTS_PER_MM:.6f} cm",
        *(f"{x:.6g} {y:.6g} {w:.6g} {h:.6g} re" for x, y, w, h in board.black_mm().tolist()),
        "f",
        *_ruler(board),
        *_text(board.left_mm, PAGE_MARGIN_MM + LINE_MM - height / 2, _instructions(board)),
    ]
    size = f"[0 0 {width * POINTS_PER_MM:.6f} {height * POINTS_PER_MM:.6f}]"
    content = "\n".join(marks).encode("ascii")
    return _document(
        # Viewers print to fit the paper unless they are asked not to.
        b"<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox {size} /Contents 4 0 R"
        " /Resources << /Font << /F1 5 0 R >> >> >>".encode(),
        b"<< /Length %d >>\nstream\n%s\nendstream" % (len(content), content),
        b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
    )


def _instructions(board: Board) -> tuple[str, str]:
    length = ruler_mm(board)
    return (
        "Print at 100 % (not 'fit to page') and glue flat on a plate of glass or metal. Measure the ruler"
        " below with a steel rule;",
        f"rig file: bench.print_scale.value = measured / {length} - 1. Laser spots go on the blank band."
        f" Squares {board.square_mm:g} mm, markers {board.marker_mm:g} mm, {board.dictionary}.",
    )


def _ruler(board: Board) -> Iterable[str]:
    length = ruler_mm(board)
    top = board.page_mm[1] / 2 - BELOW_MM + 2.0
    left = -length / 2
    yield f"{HAIRLINE_MM} w"
    yield f"{left:.6g} {top:.6g} m {-left:.6g} {top:.6g} l S"
    for millimetre in range(length + 1):
        depth = 3.0 if millimetre % RULER_STEP_MM == 0 else 2.0 if millimetre % 5 == 0 else 1.2
        yield f"{left + millimetre:.6g} {top:.6g} m {left + millimetre:.6g} {top + depth:.6g} l S"
    for millimetre in range(0, length + 1, RULER_STEP_MM):
        unit = " mm" if millimetre == length else ""
        yield from _text(left + millimetre + 0.3, top + 5.5, [f"{millimetre}{unit}"])


def _text(x_mm: float, y_mm: float, lines: Iterable[str]) -> Iterable[str]:
    """Lines of text, the first with its baseline at y; the page's frame has y down, letters have it up."""
    for number, line in enumerate(lines):
        escaped = line.replace("\\", r"\\").replace("(", r"\(").replace(")", r"\)")
        at = f"1 0 0 -1 {x_mm:.6g} {y_mm + number * LINE_MM:.6g}"
        yield f"BT /F1 {TEXT_MM} Tf {at} Tm ({escaped}) Tj ET"


def _document(*objects: bytes) -> bytes:
    """A PDF file of objects numbered from 1, the first being the catalogue."""
    parts = [b"%PDF-1.6\n"]
    offsets = []
    for number, body in enumerate(objects, start=1):
        offsets.append(sum(map(len, parts)))
        parts.append(b"%d 0 obj\n%s\nendobj\n" % (number, body))
    start = sum(map(len, parts))
    table = b"".join(b"%010d 00000 n \n" % offset for offset in offsets)
    count = len(objects) + 1
    parts.append(b"xref\n0 %d\n0000000000 65535 f \n%s" % (count, table))
    parts.append(b"trailer\n<< /Size %d /Root 1 0 R >>\nstartxref\n%d\n%%%%EOF\n" % (count, start))
    return b"".join(parts)
