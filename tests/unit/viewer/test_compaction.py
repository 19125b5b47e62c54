"""Compaction of a closed recording."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.viewer.conftest import Recorded
from tests.viewer.readback import Contents, front_tab, layout_views
from workbench.model.errors import BadInputError
from workbench.viewer import compaction
from workbench.viewer.compaction import compact
from workbench.viewer.window import is_complete


@pytest.fixture
def recording(recorded: Recorded, tmp_path: Path) -> Path:
    return Path(shutil.copy(recorded.recording, tmp_path / "recording.rrd"))


def test_a_compacted_recording_is_smaller_and_has_the_same_rows_and_layout(
    recorded: Recorded, recording: Path
) -> None:
    before = recording.stat().st_size
    assert compact(recording)
    assert recording.stat().st_size < before
    assert is_complete(recording)
    assert Contents(recording).everything() == Contents(recorded.recording).everything()
    assert front_tab(recording) == front_tab(recorded.recording)
    assert set(layout_views(recording)) == set(layout_views(recorded.recording))
    assert [path.name for path in recording.parent.iterdir()] == ["recording.rrd"]


@pytest.mark.parametrize("content", [b"no recording", b"neither, with a mark at its end: RRF2FOOT"])
def test_no_recording_is_left_alone(tmp_path: Path, content: bytes) -> None:
    damaged = tmp_path / "recording.rrd"
    damaged.write_bytes(content)
    assert not compact(damaged)
    assert damaged.read_bytes() == content
    assert list(tmp_path.iterdir()) == [damaged]


def test_without_a_viewer_the_recording_stays(recording: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing() -> Path:
        raise BadInputError("no viewer")

    monkeypatch.setattr(compaction, "viewer_executable", missing)
    before = recording.read_bytes()
    assert not compact(recording)
    assert recording.read_bytes() == before


def test_a_compaction_that_takes_too_long_leaves_the_recording(
    recording: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compaction, "LIMIT_S", 0.0)
    before = recording.read_bytes()
    assert not compact(recording)
    assert recording.read_bytes() == before
    assert [path.name for path in recording.parent.iterdir()] == ["recording.rrd"]
