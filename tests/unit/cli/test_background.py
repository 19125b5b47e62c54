"""The recording made beside a session."""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path

import pytest
from rich.console import Console

from tests.support.records import finished, placed, records, started, taken
from tests.support.running import two_laser_rig
from tests.viewer import full_disk
from tests.viewer.readback import Contents
from workbench.cli import exit as exit_
from workbench.cli.background import Background
from workbench.model import event as ev
from workbench.model.prompt import Answer, Prompt
from workbench.session.journal import read_journal
from workbench.viewer.recording import RECORDING_FILE, RecordingConsumer

FIRST = ev.SessionStarted(session="s", rig="ideal", procedures=("p",))
LAST = ev.PlacementFinished(key="a")

ROOT = Path(__file__).parents[3]


@pytest.fixture(autouse=True)
def _interpreter_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """A failed recording ends the program without the interpreter's clean-up: not the tests."""
    monkeypatch.setattr(exit_, "hung", False)


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


def test_a_full_disk_is_an_incident_and_the_session_goes_on(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-m", full_disk.__name__, tmp_path], cwd=ROOT, timeout=100)
    assert done.returncode == 0
    kinds = [record.event.kind for record in read_journal(tmp_path)]
    assert kinds.count("incident") == 1
    assert kinds.count("step_finished") == full_disk.STEPS
    assert not (tmp_path / RECORDING_FILE).exists()


def test_a_file_that_cannot_be_written_is_an_incident(tmp_path: Path) -> None:
    background = Background(
        RecordingConsumer(tmp_path, two_laser_rig(), Path("/dev/full")),
        tmp_path / RECORDING_FILE,
        Console(file=io.StringIO()),
    )
    with background, pytest.raises(ev.ConsumerFailedError) as failed:
        list(map(background, records((0, FIRST), (1, finished(1)))))
    assert failed.value.incident.of == "the recording"


class Yes:
    def ask(self, prompt: Prompt) -> Answer:
        return Answer(value=prompt.do)


def test_prompts_are_shown_in_the_recording_and_answered_by_the_person(tmp_path: Path) -> None:
    path = tmp_path / RECORDING_FILE
    recording = RecordingConsumer(tmp_path, two_laser_rig())
    with Background(recording, path, Console(file=io.StringIO())) as background:
        background(records((0, FIRST))[0])
        assert background.asking(Yes()).ask(Prompt(key="k", do="Go on?")) == Answer(value="Go on?")
    (text,) = Contents(path).static("/task", "TextDocument:text")[-1]
    assert "Go on?" in text
