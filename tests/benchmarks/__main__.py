"""`make bench`: print the tables and keep them in docs/benchmarks under today's date."""

from __future__ import annotations

import datetime as dt
import os
import platform
from pathlib import Path

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
)

RESULTS = Path(__file__).parents[2] / "docs" / "benchmarks"


def main() -> None:
    """Run, print, write."""
    today = dt.datetime.now(tz=dt.UTC).date().isoformat()
    RESULTS.mkdir(parents=True, exist_ok=True)
    subjects = {
        "spots": (speed.lines, detection.lines, accuracy.lines, speckle.lines),
        "calibration": (calibration.lines,),
        "rows": (rows.lines,),
        "ranging": (ranging.lines,),
        "capture": (capture.lines, recording.lines),
        "listing": (listing.lines,),
    }
    for subject, tables in subjects.items():
        with (RESULTS / f"{today}-{subject}.txt").open("w") as file:
            title = [f"{subject.capitalize()}, {today}, Python {platform.python_version()}"]
            for part in (title, *(table() for table in tables)):
                for line in part:
                    print(line, flush=True)
                    file.write(line + "\n")
                file.write("\n")


if __name__ == "__main__":
    main()
