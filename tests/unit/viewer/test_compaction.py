"""Compaction of a closed recording."""

from __future__ import annotations

from pathlib import Path

import pytest
import rerun as rr
from rerun.chunk import ChunkStore

from tests.viewer.conftest import Recorded
from tests.viewer.readback import Contents, layout_views
from tests.viewer.session import TRIAL, a_rig
from workbench.viewer import compaction
from workbench.viewer.blueprint import TrialTab, blueprint
from workbench.viewer.compaction import compact
from workbench.viewer.recording import RecordingConsumer
from workbench.viewer.rrd import open_rrd
from workbench.viewer.window import is_complete

LAYOUT = blueprint(a_rig(), [TrialTab(TRIAL, (("errors", "Errors"),))], "trial")


@pytest.fixture
def recording(recorded: Recorded, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The recording of a session as it was written."""
    monkeypatch.setattr("workbench.viewer.recording.compact", lambda *_: False)
    out = tmp_path / "recording.rrd"
    with RecordingConsumer(recorded.folder, recorded.rig, out) as consumer:
        for record in recorded.records:
            consumer(record)
    return out


def test_a_closed_recording_is_compacted_and_shows_the_same(recorded: Recorded, recording: Path) -> None:
    assert recorded.recording.stat().st_size < 0.8 * recording.stat().st_size
    assert is_complete(recorded.recording)
    assert Contents(recorded.recording).everything() == Contents(recording).everything()
    assert set(layout_views(recorded.recording)) == set(layout_views(recording))


def test_only_the_last_layout_is_kept(recorded: Recorded, recording: Path) -> None:
    """Rerun's own compaction would keep all of them in any order, and open with any."""
    assert len(open_rrd(recording).blueprints()) > 1
    assert len(open_rrd(recorded.recording).blueprints()) == 1
    assert not list(recorded.folder.glob("*.compacted"))


@pytest.mark.parametrize("content", [b"no recording", b"neither, with a mark at its end: RRF2FOOT"])
def test_no_recording_is_left_alone(tmp_path: Path, content: bytes) -> None:
    damaged = tmp_path / "recording.rrd"
    damaged.write_bytes(content)
    assert not compact(damaged, LAYOUT)
    assert damaged.read_bytes() == content
    assert list(tmp_path.iterdir()) == [damaged]


def test_a_copy_that_lacks_rows_replaces_nothing(recording: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = recording.read_bytes()

    class Losing(rr.RecordingStream):
        def send_chunks(self, chunks: object) -> None:
            assert isinstance(chunks, ChunkStore)
            sent = list(chunks.stream())
            sent.remove(next(chunk for chunk in sent if not chunk.is_static))
            super().send_chunks(sent)

    monkeypatch.setattr("workbench.viewer.compaction.rr.RecordingStream", Losing)
    assert not compact(recording, LAYOUT)
    assert recording.read_bytes() == before
    monkeypatch.undo()
    assert compact(recording, LAYOUT), "nothing else was wrong"


def test_a_recording_that_does_not_fit_into_memory_stays(
    recording: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compaction, "MOST_BYTES", recording.stat().st_size - 1)
    before = recording.read_bytes()
    assert not compact(recording, LAYOUT)
    assert recording.read_bytes() == before


def test_a_compaction_without_space_leaves_the_recording(
    recording: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    full = rr.FileSink("/dev/full")
    monkeypatch.setattr(rr, "FileSink", lambda _: full)
    before = recording.read_bytes()
    assert not compact(recording, LAYOUT)
    assert recording.read_bytes() == before
    assert [path.name for path in recording.parent.iterdir()] == ["recording.rrd"]
