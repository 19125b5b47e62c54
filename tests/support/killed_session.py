"""Sessions of processes that are killed: when to kill, and their results."""

from __future__ import annotations

import subprocess
import time
from pathlib import Path

from workbench.model.event import TrialFinished
from workbench.session.journal import read_journal


def wait_for_capture(sessions: Path, step: str, process: subprocess.Popen[bytes]) -> Path:
    """The session's folder, as soon as the step has captured something and has not ended."""
    deadline = time.monotonic() + 300  # the first run compiles
    while time.monotonic() < deadline:
        assert process.poll() is None, "it ended before it was killed"
        for journal in sessions.glob("*/journal.jsonl"):
            if f'"kind":"capture_taken","key":"{step}/' in journal.read_text(errors="replace"):
                return journal.parent
        time.sleep(0.01)
    raise AssertionError(f"{step} captured nothing")


def trial_finished(session: Path, step: str) -> TrialFinished:
    """Results of a trial in the journal."""
    events = [record.event for record in read_journal(session)]
    (found,) = [event for event in events if isinstance(event, TrialFinished) and event.trial == step]
    return found
