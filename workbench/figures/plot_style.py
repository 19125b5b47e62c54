"""Style of all matplotlib figures of the workbench."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from threading import RLock

import matplotlib as mpl

_STYLE = RLock()
"""Held while matplotlib's settings are ours."""
INK, PAPER, FAINT = "#e6e6e6", "#121416", "#3a3d40"
"""Colours on a dark ground: among the panels of the viewer."""


@contextmanager
def own_style(*, dark: bool = False) -> Iterator[None]:
    """Context with matplotlib's defaults, independent of a user's matplotlibrc, and reproducible files.

    The settings are those of the whole process: another thread that draws waits until the context ends.
    SVG: text as outlines, ids from a fixed salt. PDF: only the fonts that every reader provides.
    """
    with _STYLE, mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(
            {
                "font.size": 9,
                "svg.fonttype": "path",
                "svg.hashsalt": "workbench",
                "pdf.use14corefonts": True,
                "grid.color": "#dddddd",
                "grid.linewidth": 0.7,
            }
        )
        if dark:
            mpl.rcParams.update(
                {
                    "font.size": 11,
                    "figure.facecolor": PAPER,
                    "axes.facecolor": PAPER,
                    "savefig.facecolor": PAPER,
                    "axes.edgecolor": FAINT,
                    "grid.color": FAINT,
                    "text.color": INK,
                    "axes.labelcolor": INK,
                    "axes.titlecolor": INK,
                    "xtick.color": INK,
                    "ytick.color": INK,
                }
            )
        yield
