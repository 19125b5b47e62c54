"""Verdict and five numbers of the first page."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.reference_session import copied, record
from workbench.model import event as ev
from workbench.report.certificate.range_uncertainty import TABLE_MM, range_uncertainties
from workbench.report.certificate.session_record import SessionRecord, read_session
from workbench.report.certificate.summary import key_numbers, verdict_of
from workbench.session.journal import JOURNAL


def cut(folder: Path, last: int) -> SessionRecord:
    """The session with its first records only."""
    session = copied(folder)
    lines = (session / JOURNAL).read_text().splitlines(keepends=True)
    (session / JOURNAL).write_text("".join(lines[:last]))
    return read_session(session)


def changed(folder: Path, **update: object) -> SessionRecord:
    """The session with a change of its fits."""
    session = copied(folder)
    lines = []
    for record_ in record().all_records:
        event = record_.event
        if isinstance(event, ev.FitFinished):
            record_ = record_.model_copy(update={"event": event.model_copy(update=update)})
        if not (isinstance(event, ev.CalibrationExported) and update.get("verdict") == "refused"):
            lines.append(record_)
    renumbered = [one.model_copy(update={"n": n}) for n, one in enumerate(lines)]
    (session / JOURNAL).write_text("".join(f"{one.model_dump_json()}\n" for one in renumbered))
    return read_session(session)


def test_five_numbers_of_the_reference_session() -> None:
    session = record()
    assert session.calibration is not None
    assert session.fit is not None
    numbers = key_numbers(session, session.calibration, range_uncertainties(session.calibration, TABLE_MM))
    assert len(numbers) == 5
    assert numbers[0].value == "150 to 900 mm"
    assert numbers[3].value == f"{session.fit.rms_px:.3f} px"
    errors = {
        mm: [e.error_mm for e in session.events(ev.ReadingTaken) if e.standoff_mm == mm] for mm in (180, 500)
    }
    worst = max((sum(e for e in found if e is not None) / 3 / mm for mm, found in errors.items()), key=abs)
    assert numbers[4].value == f"{100 * worst:+.2f} %"


def test_an_accepted_calibration_is_good() -> None:
    verdict = verdict_of(record(), record().calibration)
    assert verdict.tone == "good"
    assert verdict.reasons[0].startswith("reference.6: ")


def test_a_refused_fit_is_bad_and_names_its_reasons(tmp_path: Path) -> None:
    session = changed(tmp_path, verdict="refused", reasons=("too few standoffs",))
    verdict = verdict_of(session, session.calibration)
    assert (verdict.tone, verdict.reasons[0]) == ("bad", "too few standoffs")


@pytest.mark.parametrize("last", [0, 10])
def test_an_unfinished_session_is_open_and_its_numbers_are_dashes(tmp_path: Path, last: int) -> None:
    session = cut(tmp_path, last)
    assert verdict_of(session, None).tone == "open"
    assert [one.value for one in key_numbers(session, None, ())] == ["-"] * 5
