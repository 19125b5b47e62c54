"""PDF page of the printed board at true size: rectangles, a ruler to check the scale, instructions."""

from __future__ import annotations

from io import BytesIO

from matplotlib.axes import Axes
from matplotlib.backends.backend_pdf import Name, PdfFile, RendererPdf
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from workbench.figures.plot_style import own_style
from workbench.model.board import BELOW_MM, PAGE_MARGIN_MM, Board

MM_PER_INCH = 25.4
POINTS_PER_INCH = 72
POINTS_PER_MM = POINTS_PER_INCH / MM_PER_INCH
TEXT_MM = 3.0
LINE_MM = 4.0
ASCENT_MM = 2.4
"""Height of letters above the baseline."""
RULER_STEP_MM = 10
LONGEST_RULER_MM = 200
HAIRLINE_MM = 0.15


def ruler_mm(board: Board) -> int:
    """Length of the printed ruler: whole centimetres, at most the width of the blocks."""
    width = int(board.columns * board.square_mm)
    return min(LONGEST_RULER_MM, width - width % RULER_STEP_MM)


def board_page(board: Board) -> bytes:
    """PDF file with one page of `board.page_mm`; equal boards give equal bytes."""
    width_in, height_in = (mm / MM_PER_INCH for mm in board.page_mm)
    figure = Figure(figsize=(width_in, height_in), dpi=POINTS_PER_INCH)
    file = BytesIO()
    with own_style():
        _draw(figure, board)
        pdf = PdfFile(file, metadata={"CreationDate": None, "Creator": None, "Producer": None})
        _disable_print_scaling(pdf)
        pdf.newPage(width_in, height_in)
        figure.draw(RendererPdf(pdf, POINTS_PER_INCH, height_in, width_in))
        pdf.finalize()
    return file.getvalue()


def _disable_print_scaling(pdf: PdfFile) -> None:
    """Set the viewer preference against fitting the page to the paper (ISO 32000-1, 12.2).

    Matplotlib has no option for it and has already written the catalogue (7.7.2). The catalogue is written
    again, and the cross-reference table of the file refers to the second one.
    """
    preferences = {"PrintScaling": Name("None")}
    catalogue = {"Type": Name("Catalog"), "Pages": pdf.pagesObject, "ViewerPreferences": preferences}
    pdf.writeObject(pdf.rootObject, catalogue)


def _draw(figure: Figure, board: Board) -> None:
    """Draw in the board's frame: millimetres from the middle of the page, y down."""
    width, height = board.page_mm
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(-width / 2, width / 2), ylim=(height / 2, -height / 2))
    axes.axis("off")
    squares = [_rectangle(*numbers) for numbers in board.black_mm().tolist()]
    axes.add_patch(PathPatch(Path.make_compound_path(*squares), facecolor="black", linewidth=0))
    _draw_ruler(axes, board)
    for number, line in enumerate(_instructions(board)):
        at_mm = PAGE_MARGIN_MM + ASCENT_MM + LINE_MM * number - height / 2
        _write(axes, board.left_mm, at_mm, line)


def _rectangle(left: float, top: float, width: float, height: float) -> Path:
    right, bottom = left + width, top + height
    return Path([(left, top), (right, top), (right, bottom), (left, bottom), (left, top)], closed=True)


def _instructions(board: Board) -> tuple[str, str]:
    length = ruler_mm(board)
    return (
        "Print at 100 % (not 'fit to page') and glue flat on a plate of glass or metal. Measure the ruler"
        " below with a steel rule;",
        f"rig file: bench.print_scale.value = measured / {length} - 1. Place the spots on the blank band."
        f" Squares {board.square_mm:g} mm, markers {board.marker_mm:g} mm, {board.dictionary}.",
    )


def _draw_ruler(axes: Axes, board: Board) -> None:
    length = ruler_mm(board)
    top, left = board.page_mm[1] / 2 - BELOW_MM + 2.0, -length / 2
    ticks = [[(left + mm, top), (left + mm, top + _tick_mm(mm))] for mm in range(length + 1)]
    lines = [[(left, top), (-left, top)], *ticks]
    axes.add_collection(
        LineCollection(lines, colors="black", linewidths=HAIRLINE_MM * POINTS_PER_MM, capstyle="butt"),
        autolim=False,
    )
    for mm in range(0, length + 1, RULER_STEP_MM):
        _write(axes, left + mm + 0.3, top + 5.5, f"{mm} mm" if mm == length else f"{mm}")


def _tick_mm(at_mm: int) -> float:
    if at_mm % RULER_STEP_MM == 0:
        return 3.0
    return 2.0 if at_mm % 5 == 0 else 1.2


def _write(axes: Axes, x_mm: float, baseline_mm: float, text: str) -> None:
    size = TEXT_MM * POINTS_PER_MM
    axes.text(x_mm, baseline_mm, text, fontsize=size, fontfamily="Helvetica", fontweight="medium")
