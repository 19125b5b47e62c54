"""`make bench`: print the tables and keep them in docs/benchmarks under today's date."""

from __future__ import annotations

import os
import platform

# One core, as stated in the tables; read when the numerical libraries load.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

from tests.benchmarks import (
    accuracy,
    calibration,
    capture,
    detection,
    listing,
    ranging,
    recording,
    rows,
    speckle,
    speed,
    world_frames,
)
from tests.support.stored_output import store


def main() -> None:
    """Run, print, write."""
    subjects = {
        "spots": (speed.lines, detection.lines, accuracy.lines),
        "speckle": (speckle.lines,),
        "calibration": (calibration.lines,),
        "rows": (rows.lines,),
        "ranging": (ranging.lines,),
        "capture": (capture.lines, recording.lines),
        "listing": (listing.lines,),
        "world-frames": (world_frames.lines,),
    }
    for subject, tables in subjects.items():
        lines = [f"Python {platform.python_version()}"]
        for table in tables:
            lines += ["", *table()]
        store(subject, subject.capitalize(), "make bench", lines)


if __name__ == "__main__":
    main()
