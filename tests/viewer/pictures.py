"""Pictures of the documentation: `python -m tests.viewer.pictures OUT`, a PNG of each screen of the demo."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import cv2

from tests.viewer.harness import headless_viewer

COMMAND = [
    "procedures/calibrate-flat.yaml",
    "procedures/accuracy-flat.yaml",
    "--rig",
    "rigs/thesis-emulated.yaml",
]
CALIBRATION, TRIAL = 160, 550
"""Captures that the pictures show: the last one at a placement, when the crops of all lasers are there."""
SHOWN = {
    "captures": CALIBRATION,
    "fit": CALIBRATION,
    "fit-details": CALIBRATION,
    "trial": TRIAL,
    "bench": TRIAL,
}
"""Capture of each picture, in the order of the screens from the left."""
SMALL = (cv2.IMWRITE_PNG_COMPRESSION, 9, cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_DEFAULT)
"""Files of less than half the size of OpenCV's default, which is for speed."""


def take(session: Path, out: Path) -> None:
    """Open the session's recording and take a picture of every screen."""
    with tempfile.TemporaryDirectory() as home, headless_viewer(Path(home), "1600x900") as viewer:
        viewer.open(session / "recording.rrd")
        for tab, (name, capture) in zip(viewer.tabs(), SHOWN.items(), strict=True):
            viewer.show_tab(tab)
            viewer.go_to("capture", capture)
            cv2.imwrite(str(out / f"{name}.png"), viewer.shot(), SMALL)


def main(out: Path) -> None:
    """Run the demo in a temporary folder and take its pictures."""
    workbench = Path(sys.executable).with_name("workbench")
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([workbench, "run", *COMMAND, "--sessions", folder], check=True)
        (session,) = (path for path in Path(folder).iterdir() if path.is_dir())
        take(session, out)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
