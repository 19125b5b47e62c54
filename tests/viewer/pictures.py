"""Pictures of the documentation: `python -m tests.viewer.pictures` (`make pictures`).

Screens of a new run of the demo, of a calibration with faults, and of the session of notebook 2; charts of
the stored simulation. `python -m tests.viewer.certificate` prints the certificate.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.viewer.faults import write_session
from tests.viewer.harness import Viewer, headless_viewer, write_png
from tests.viewer.manifest import BAD_STANDOFF, CHARTS, DEMO_SCREENS, IMAGES, chart_svg, record
from workbench.session.journal import read_journal
from workbench.session.manifest import load_session_rig
from workbench.session.state import effective
from workbench.viewer.recording import RECORDING_FILE, rebuild

COMMAND = [
    "procedures/calibrate-flat.yaml",
    "procedures/accuracy-flat.yaml",
    "--rig",
    "rigs/thesis-emulated.yaml",
]
CALIBRATION, TRIAL = 160, 550
"""Captures that the pictures show: the last one at a placement, when the crops of all lasers are there."""
SHOWN = dict(zip(DEMO_SCREENS, (CALIBRATION, CALIBRATION, CALIBRATION, TRIAL, TRIAL), strict=True))
"""Capture of each picture, in the order of the screens from the left."""
CELL_PX = "1290x758"
"""Size of the viewer in a notebook's cell."""


def take_demo(folder: Path) -> None:
    """Run the demo, and take a picture of every screen of its recording."""
    workbench = Path(sys.executable).with_name("workbench")
    subprocess.run([workbench, "run", *COMMAND, "--sessions", folder], check=True)
    (session,) = (path for path in folder.iterdir() if path.is_dir())
    with opened(session / RECORDING_FILE, folder) as viewer:
        for tab, (name, capture) in zip(viewer.tabs(), SHOWN.items(), strict=True):
            viewer.show_tab(tab)
            viewer.go_to("capture", capture)
            write_png(IMAGES / name, viewer.shot())


def take_faults(folder: Path) -> None:
    """Take the screen that opens of a calibration with faults."""
    with opened(write_session(folder) / RECORDING_FILE, folder) as viewer:
        write_png(IMAGES / "faults.png", viewer.shot())


def take_notebook_viewer(folder: Path) -> None:
    """Take the screen that opens of the session of notebook 2, in the size of a cell."""
    recording, records = folder / RECORDING_FILE, list(effective(read_journal(BAD_STANDOFF)))
    rebuild(BAD_STANDOFF, load_session_rig(BAD_STANDOFF), records, recording)
    with opened(recording, folder, CELL_PX) as viewer:
        write_png(IMAGES / "notebook-viewer.png", viewer.shot())


@contextmanager
def opened(recording: Path, home: Path, size_px: str = "1600x900") -> Iterator[Viewer]:
    """A viewer that shows a recording."""
    with headless_viewer(home, size_px) as viewer:
        viewer.open(recording)
        yield viewer


def main() -> None:
    """Take all pictures, and record what they show."""
    for take in (take_demo, take_faults, take_notebook_viewer):
        with tempfile.TemporaryDirectory() as folder:
            take(Path(folder))
    for name in CHARTS:
        (IMAGES / f"{name}.svg").write_bytes(chart_svg(name))
    record(*DEMO_SCREENS, "faults.png", "notebook-viewer.png")


if __name__ == "__main__":
    main()
