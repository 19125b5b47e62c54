"""Observations from a recording: those of the session itself, bit for bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from workbench.calibration.data.spot_rows import observations_of_rows
from workbench.model.captures import load_captures
from workbench.model.errors import BadInputError
from workbench.model.event import CaptureTaken, SpotsFound
from workbench.model.rig import Rig
from workbench.session.journal import read_journal
from workbench.session.manifest import load_session_rig
from workbench.session.state import effective
from workbench.viewer.readback import observations_of_recording
from workbench.viewer.recording import rebuild

SESSION = Path(__file__).parents[3] / "data/session-0.1.0"


@pytest.fixture(scope="module")
def rig() -> Rig:
    return load_session_rig(SESSION)


@pytest.fixture(scope="module")
def recording(rig: Rig, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recording") / "recording.rrd"
    rebuild(SESSION, rig, effective(read_journal(SESSION)), path)
    return path


def test_observations_are_those_of_the_captures_table(rig: Rig, recording: Path) -> None:
    found, rejected, boards = observations_of_recording(recording, rig)
    expected, also_rejected, _ = observations_of_rows(rig, load_captures(SESSION / "captures.csv"))
    assert len(found) == len(expected) == 6
    assert len(rejected) == len(also_rejected)
    assert boards == []
    events = [r.event for r in read_journal(SESSION) if isinstance(r.event, SpotsFound)]
    journalled = np.array([(s.u_px, s.v_px, s.u_sd_px, s.v_sd_px) for e in events for s in e.spots])
    for one, other in zip(found, expected, strict=True):
        assert (one.laser_id, one.placement, one.standoff_mm, one.repeat, one.saturated) == (
            other.laser_id,
            other.placement,
            other.standoff_mm,
            other.repeat,
            other.saturated,
        )
        assert one.part == other.part
        # The recording has the spots of the journal; the table's images are searched by today's program.
        numbers = (one.u_px, one.v_px, one.u_sd_px, one.v_sd_px)
        assert np.isclose(journalled, numbers, rtol=1e-9).all(axis=1).any()
        assert abs(one.u_px - other.u_px) < 3 * one.u_sd_px


def test_times_are_those_of_the_journal(rig: Rig, recording: Path) -> None:
    found, _, _ = observations_of_recording(recording, rig)
    taken = [r.event for r in read_journal(SESSION) if isinstance(r.event, CaptureTaken)]
    first_ns = min(capture.time_ns for capture in taken)
    by_source = {capture.on.path: (capture.time_ns - first_ns) / 1e9 for capture in taken}
    assert [one.time_s for one in found] == [by_source[one.source] for one in found]


@pytest.mark.filterwarnings("ignore:RRD file has no footer")
def test_a_recording_without_its_footer_is_read(rig: Rig, recording: Path, tmp_path: Path) -> None:
    whole = recording.read_bytes()
    cut = tmp_path / "cut.rrd"
    cut.write_bytes(whole[: whole.rindex(b"RRF2FOOT") - 1])
    assert repr(observations_of_recording(cut, rig)) == repr(observations_of_recording(recording, rig))


@pytest.mark.parametrize("content", [b"", b"no recording", b"RRF2" + bytes(100)])
def test_another_file_is_refused(rig: Rig, tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "other.rrd"
    path.write_bytes(content)
    with pytest.raises(BadInputError, match="recording"):
        observations_of_recording(path, rig)


def test_a_recording_of_another_rig_is_refused(rig: Rig, recording: Path) -> None:
    first, *others = rig.lasers
    other = rig.model_copy(update={"lasers": (first.model_copy(update={"id": "L9"}), *others)})
    with pytest.raises(BadInputError, match="L9"):
        observations_of_recording(recording, other)
