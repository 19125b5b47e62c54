"""Style of all matplotlib figures of the workbench."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import matplotlib as mpl


@contextmanager
def own_style() -> Iterator[None]:
    """Context with matplotlib's defaults, independent of a user's matplotlibrc, and reproducible files.

    SVG: text as outlines, ids from a fixed salt. PDF: only the fonts that every reader provides.
    """
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(
            {
                "font.size": 9,
                "svg.fonttype": "path",
                "svg.hashsalt": "workbench",
                "pdf.use14corefonts": True,
            }
        )
        yield
