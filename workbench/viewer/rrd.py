"""Reader of recordings with and without an index in their footer."""

from __future__ import annotations

import warnings
from pathlib import Path

from rerun.chunk import RrdReader
from rerun.error_utils import RerunWarning


def open_rrd(path: Path) -> RrdReader:
    """Open a recording; without an index, as while it is written, it is read from its beginning.

    Raises:
        OSError, RuntimeError: the file is no recording.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RerunWarning)
        return RrdReader(str(path))
