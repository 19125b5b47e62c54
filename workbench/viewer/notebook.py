"""Viewer in a cell of a notebook."""

from __future__ import annotations

import io
import os
import tempfile
from collections.abc import Iterable
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

from workbench.model import event as ev
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig
from workbench.viewer.recording import RECORDING_FILE, rebuild

ASSETS = ("RERUN_NOTEBOOK_ASSET", "serve-local")
"""Read by rerun-notebook when it is imported: the page loads the viewer from this computer. Its default is a
server of Rerun, which needs a network."""


def notebook_viewer(session_dir: Path, rig: Rig, records: Iterable[ev.Record], height_px: int) -> Any:
    """Widget of the Rerun viewer with the recording of a session, made again from its records.

    Args:
        session_dir: folder with the frames.
        rig: the session's rig.
        records: records that are in effect.
        height_px: height of the widget; it is as wide as the cell.

    Raises:
        BadInputError: the package rerun-notebook is missing, or a frame is missing or has changed.
    """
    os.environ.setdefault(*ASSETS)
    try:
        with redirect_stdout(io.StringIO()):  # it prints the address of its server
            from rerun_notebook import Viewer
    except ImportError:
        raise BadInputError(
            "expected the package rerun-notebook, which is not installed; do: pip install"
            " 'laser-range-workbench[notebooks]'"
        ) from None
    viewer = Viewer(width="auto", height=height_px, theme="dark")  # our charts are dark
    with tempfile.TemporaryDirectory() as folder:
        recording = Path(folder) / RECORDING_FILE
        rebuild(session_dir, rig, records, recording)
        viewer.send_rrd(recording.read_bytes())
    return viewer
