"""The recording made beside a session."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from rich.console import Console

from tests.support.records import placed, records, started, taken
from tests.support.running import two_laser_rig
from workbench.cli.background import Background
from workbench.model import event as ev
from workbench.viewer.recording import RECORDING_FILE, RecordingConsumer

FIRST = ev.SessionStarted(session="s", rig="ideal", procedures=("p",))
LAST = ev.PlacementFinished(key="a")


def recorded(folder: Path, *events: ev.Event) -> str:
    """Have the events recorded; what is said at the end."""
    stream, path = io.StringIO(), folder / RECORDING_FILE
    recording = RecordingConsumer(folder, two_laser_rig())
    with Background(recording, path, Console(file=stream, width=200)) as background:
        for record in records(*((float(n), event) for n, event in enumerate(events))):
            background(record)
    return stream.getvalue()


def test_records_are_kept_in_a_file(tmp_path: Path) -> None:
    assert recorded(tmp_path, FIRST, started(1, 4), placed("a"), LAST) == ""
    assert (tmp_path / RECORDING_FILE).stat().st_size > 0


@pytest.mark.parametrize(
    "event",
    [ev.SetAside(key="a", from_n=1, reason="snr"), taken("a1", 0.1)],
    ids=["a placement captured again", "a frame that is not there"],
)
def test_a_recording_that_is_not_whole_is_not_kept(tmp_path: Path, event: ev.Event) -> None:
    assert "workbench view" in recorded(tmp_path, FIRST, started(1, 4), placed("a"), event, LAST)
    assert not (tmp_path / RECORDING_FILE).exists()
