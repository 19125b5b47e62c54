"""Tables of the documentation as the terminal prints them."""

from __future__ import annotations

from textwrap import fill

from tests.support.stored_output import newest
from tests.tables.markdown import code_block, markdown_table

WIDTH, INDENT = 80, 10 * " "
"""Columns of the terminal, and those of the names of lines, by which it indents."""
LEFT_OUT = ("L2.", "L3.", "L4.")
"""Parameters that the output of a design leaves out in the documentation."""
DESIGN_HEADING = ("standoffs, 10 readings each", "worst, 0.1 - 5 m", "by the calibration alone")
COMPARED = {
    "calibrate-flat.yaml, 11": "`calibrate-flat.yaml`, 11 from 125 to 4500 mm",
    "proposed, 11": "proposed, 11 from 100 to 5000 mm",
    "by the worst range alone, 11": "by the worst range alone, 11",
}
"""Designs of the stored output, and how the documentation calls them."""


def demo_trial() -> str:
    """Both tables of the accuracy trial."""
    lines = newest("demo").lines
    return code_block("\n".join(lines[: _line("demo", "a reading is the mean") + 1]))


def demo_verdict() -> str:
    """The end of the session."""
    lines = newest("demo").lines[_line("demo", "ACCEPTED") :]
    wrapped = [fill(line, WIDTH, subsequent_indent=INDENT, break_on_hyphens=False) for line in lines]
    return code_block("\n".join(wrapped))


def design() -> str:
    """Output of `workbench design`, with the parameters of one laser."""
    lines = newest("design").lines
    shown = [line for line in lines[: _line("design", "standoffs  ")] if not line.startswith(LEFT_OUT)]
    rows = [n for n, line in enumerate(shown) if line.startswith("L1.ty")]
    shown.insert(rows[0] + 1, "  ...")
    return code_block("\n".join(["$ workbench design --rig rigs/thesis-emulated.yaml", *shown]))


def designs() -> str:
    """Proposed standoffs compared with others."""
    rows = [(COMPARED[name], *figures) for name, figures in _designs().items() if name in COMPARED]
    heading = (*DESIGN_HEADING, "laser 1 at 150 mm")
    return markdown_table(heading, rows)


def design_counts() -> str:
    """Worst range for several numbers of proposed standoffs."""
    found = {name: figures for name, figures in _designs().items() if name.startswith("proposed")}
    rows = [(name.partition(", ")[2], *figures[:2]) for name, figures in found.items()]
    return markdown_table(DESIGN_HEADING, rows, numbers_from=0)


def _designs() -> dict[str, tuple[str, ...]]:
    """Figures in per cent by the name of the design."""
    rows = [line.rsplit(maxsplit=3) for line in newest("design").lines[_line("design", "standoffs  ") + 1 :]]
    return {name: tuple(f"{figure} %" for figure in figures) for name, *figures in rows}


def _line(subject: str, beginning: str) -> int:
    """Number of the first line of a stored output that begins so."""
    return next(n for n, line in enumerate(newest(subject).lines) if line.startswith(beginning))
