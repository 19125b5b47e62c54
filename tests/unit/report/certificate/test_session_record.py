"""Session as a certificate reads it: valid events, void ones with their time, hashes of the files."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from tests.support.reference_session import REFERENCE, copied, edit_calibration, record
from workbench.model import event as ev
from workbench.model.errors import BadInputError
from workbench.report.certificate.session_record import read_session
from workbench.session.journal import JOURNAL


def test_valid_events_leave_out_those_before_a_repair() -> None:
    session = record()
    assert len([r for r in session.all_records if isinstance(r.event, ev.FitFinished)]) == 2
    (fit,) = session.events(ev.FitFinished)
    assert session.fit is fit
    ((when, repaired),) = session.timed(ev.SessionRepaired)
    assert when.startswith("2026-11-30 08:50:")
    assert repaired.recapture == ("reference.3/280mm",)


def test_hashes_are_those_of_the_files() -> None:
    session = record()
    assert session.journal_sha256 == hashlib.sha256((REFERENCE / JOURNAL).read_bytes()).hexdigest()
    frames = [frame for c in session.events(ev.CaptureTaken) for frame in (c.on, c.off) if frame]
    lines = "".join(f"{frame.path} {frame.sha256}\n" for frame in frames)
    assert session.frames_sha256 == hashlib.sha256(lines.encode()).hexdigest()
    assert all(hashlib.sha256((REFERENCE / f.path).read_bytes()).hexdigest() == f.sha256 for f in frames)


def test_a_session_without_journal_has_no_records(tmp_path: Path) -> None:
    session = copied(tmp_path)
    (session / JOURNAL).unlink()
    found = read_session(session)
    assert (found.records, found.calibration, found.fit, found.began) == ((), None, None, None)
    assert found.journal_sha256 == ""


def test_a_calibration_that_was_edited_since_is_refused(tmp_path: Path) -> None:
    session = copied(tmp_path)
    found = read_session(session)
    assert found.calibration_sha256 == found.events(ev.CalibrationExported)[-1].sha256
    edit_calibration(session)
    with pytest.raises(BadInputError, match="changed"):
        _ = read_session(session).calibration


def test_a_damaged_session_is_refused(tmp_path: Path) -> None:
    session = copied(tmp_path)
    (session / JOURNAL).write_text("damaged\n")
    with pytest.raises(BadInputError, match=f"{JOURNAL}:1"):
        read_session(session)
