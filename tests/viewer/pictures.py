"""The documentation's pictures: `python -m tests.viewer.pictures SESSION OUT`, one PNG for each tab."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import cv2

from tests.viewer.harness import headless_viewer

TABS = ("Live", "Fit", "Trial", "3D")


def take(session: Path, out: Path) -> None:
    """Open the session's recording and take a picture of every tab."""
    with tempfile.TemporaryDirectory() as home, headless_viewer(Path(home), "1600x900") as viewer:
        viewer.open(session / "recording.rrd")
        for tab in TABS:
            viewer.show_tab(tab)
            cv2.imwrite(str(out / f"{tab.lower()}.png"), viewer.shot())


if __name__ == "__main__":
    take(Path(sys.argv[1]), Path(sys.argv[2]))
