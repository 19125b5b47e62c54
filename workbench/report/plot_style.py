"""Style of everything that matplotlib draws for the workbench."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import matplotlib as mpl


@contextmanager
def own_style() -> Iterator[None]:
    """Matplotlib's defaults whatever a user's matplotlibrc says, and files that do not vary.

    SVG: text as outlines, and ids by a fixed salt. PDF: the fonts that every reader has.
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
