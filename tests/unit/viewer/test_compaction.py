"""Compaction of a closed recording."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator, Sequence
from itertools import count, cycle, islice
from pathlib import Path

import pytest
import rerun as rr
from rerun.chunk import ChunkStore

from tests.viewer.conftest import Recorded
from tests.viewer.readback import Contents, layout_views
from tests.viewer.session import LASERS, REPEATS, STANDOFFS, TRIAL, a_rig
from workbench.model import event as ev
from workbench.viewer import compaction
from workbench.viewer.blueprint import TrialTab, blueprint
from workbench.viewer.compaction import compact
from workbench.viewer.recording import RecordingConsumer
from workbench.viewer.rrd import open_rrd
from workbench.viewer.stream import Stream
from workbench.viewer.window import is_complete, viewer_environment, viewer_executable

ROOT = Path(__file__).parents[3]
MOST_GROWTH_MB = 500.0
COMPACT = """
import re, sys, time
from pathlib import Path
from tests.unit.viewer.test_compaction import LAYOUT
from workbench.viewer.compaction import compact

def peak_mb():
    return int(re.search(r"VmHWM:\\s+(\\d+)", Path("/proc/self/status").read_text())[1]) / 1024

before, began = peak_mb(), time.monotonic()
done = compact(Path(sys.argv[1]), LAYOUT)
print(done, f"{time.monotonic() - began:.1f}", peak_mb() - before)
"""
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


def repeated(records: Sequence[ev.Record], captures: int) -> Iterator[ev.Record]:
    """Records of a session with its captures of the calibration repeated up to a number."""
    numbers = count()
    first = next(n for n, record in enumerate(records) if isinstance(record.event, ev.CaptureTaken))
    pairs = [r for r in records if isinstance(r.event, ev.CaptureTaken | ev.SpotsFound)][
        : 2 * len(LASERS) * len(STANDOFFS) * REPEATS
    ]
    for record in (*records[:first], *islice(cycle(pairs), 2 * captures)):
        number = next(numbers)
        yield record.model_copy(update={"n": number, "time_ns": records[0].time_ns + number * 10**7})


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
            super().send_chunks(sent if sent[0].is_static else sent[1:])

    monkeypatch.setattr("workbench.viewer.compaction.rr.RecordingStream", Losing)
    assert not compact(recording, LAYOUT)
    assert recording.read_bytes() == before
    monkeypatch.undo()
    assert compact(recording, LAYOUT), "nothing else was wrong"


def test_a_recording_in_many_blocks_shows_the_same(recording: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compaction, "BLOCK_BYTES", 1 << 14)
    monkeypatch.setattr(compaction, "FIRST_CHUNKS", 7)
    before, size = Contents(recording).everything(), recording.stat().st_size
    assert compact(recording, LAYOUT)
    assert Contents(recording).everything() == before
    assert recording.stat().st_size < size


def test_of_static_values_the_last_of_each_component_is_kept(tmp_path: Path) -> None:
    recording = tmp_path / "recording.rrd"
    stream = Stream(recording, "s", LAYOUT)
    for value in range(5):
        stream.log("a", rr.AnyValues(first=value, second=value), static=True)
        stream.flush()  # each value in a chunk of its own
    stream.log("a", rr.AnyValues(second=9), static=True)
    stream.close()
    assert compact(recording, LAYOUT)
    contents = Contents(recording)
    assert contents.static("/a", "first") == [[4]]
    assert contents.static("/a", "second")[-1] == [9]


@pytest.mark.thorough
def test_a_large_recording_is_compacted_in_bounded_memory(
    recorded: Recorded, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """3000 captures, in a process of its own; the bound leaves twice what 16 MB at a time take."""
    monkeypatch.setattr("workbench.viewer.recording.compact", lambda *_: False)
    recording = tmp_path / "recording.rrd"
    with RecordingConsumer(recorded.folder, recorded.rig, recording) as consumer:
        for record in repeated(recorded.records, 3000):
            consumer(record)
    size = recording.stat().st_size
    run = subprocess.run(
        [sys.executable, "-c", COMPACT, recording], capture_output=True, text=True, check=True, cwd=ROOT
    )
    done, seconds, growth_mb = run.stdout.split()
    print(
        f"{size / 1e6:.0f} to {recording.stat().st_size / 1e6:.0f} MB, {seconds} s, {growth_mb} MB of memory"
    )
    assert done == "True"
    assert size > 128e6
    assert recording.stat().st_size < 0.9 * size
    assert float(growth_mb) < MOST_GROWTH_MB
    verify: list[str | Path] = [viewer_executable(), "rrd", "verify", recording]
    verified = subprocess.run(verify, env=viewer_environment(), capture_output=True, check=False)
    assert verified.returncode == 0, verified.stderr


def test_a_compaction_without_space_leaves_the_recording(
    recording: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    full = rr.FileSink("/dev/full")
    monkeypatch.setattr(rr, "FileSink", lambda _: full)
    before = recording.read_bytes()
    assert not compact(recording, LAYOUT)
    assert recording.read_bytes() == before
    assert [path.name for path in recording.parent.iterdir()] == ["recording.rrd"]
