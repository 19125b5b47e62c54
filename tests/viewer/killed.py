"""Records part of a session into the folder given, then dies without closing anything."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

from tests.viewer.session import MadeUpSession, a_rig
from workbench.model.event import StepFinished
from workbench.viewer.recording import RecordingConsumer

WRITER_SECONDS = 1.0
"""Time for the writer's thread: what was logged an instant before the end may be lost."""


def main(folder: Path) -> None:
    consumer = RecordingConsumer(folder, a_rig())
    for record in MadeUpSession(folder).records():
        consumer(record)
        if isinstance(record.event, StepFinished):
            break
    time.sleep(WRITER_SECONDS)
    os._exit(9)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
