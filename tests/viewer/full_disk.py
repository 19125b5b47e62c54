"""Runs a session whose recording cannot grow beyond a size: `python -m tests.viewer.full_disk FOLDER`."""

from __future__ import annotations

import io
import resource
import sys
from pathlib import Path

from rich.console import Console

from tests.viewer.session import MadeUpSession, a_rig
from workbench.cli import background
from workbench.cli.exit import exit_program
from workbench.model.event import StepFinished
from workbench.procedure.engine.replay import ReplayingJournal
from workbench.session.journal import Journal
from workbench.viewer.recording import RECORDING_FILE, RecordingConsumer

LARGEST_FILE = 600_000
"""Bytes: more than a frame, less than the recording of a step."""
STEPS = 2


def main(session: Path) -> None:
    resource.setrlimit(resource.RLIMIT_FSIZE, (LARGEST_FILE, resource.RLIM_INFINITY))
    recording = RecordingConsumer(session, a_rig())
    background.SETTLE_S = 60.0  # the recording fails within the step, also beside other programs
    beside = background.Background(recording, session / RECORDING_FILE, Console(file=io.StringIO()))
    steps = 0
    with beside, Journal(session) as journal:
        recorder = ReplayingJournal(journal, [beside])
        for record in MadeUpSession(session).records():
            recorder.emit(record.event)
            steps += isinstance(record.event, StepFinished)
            if steps == STEPS:
                break
    exit_program(0)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
