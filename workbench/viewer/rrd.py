"""Recordings by Rerun's own library: opening files, and releasing recordings that are no longer used."""

from __future__ import annotations

import warnings
from pathlib import Path

import rerun as rr
from rerun.chunk import RrdReader
from rerun.error_utils import RerunWarning

from workbench.viewer.entities import APPLICATION


def open_rrd(path: Path) -> RrdReader:
    """Open a recording; without an index, as while it is written, it is read from its beginning.

    Raises:
        OSError, RuntimeError: the file is no recording.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RerunWarning)
        return RrdReader(str(path))


def release_unused() -> None:
    """End the threads of recordings to which nothing refers any longer.

    Rerun keeps a disconnected recording until its next initialization. Its threads wake more than a hundred
    times a second.
    """
    rr.init(APPLICATION, init_logging=False)
