"""Five numbers of the first page."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.reference_session import copied, record
from workbench.model import event as ev
from workbench.report.certificate.range_uncertainty import curve_mm, range_uncertainties, table_mm
from workbench.report.certificate.session_record import read_session
from workbench.report.certificate.summary import key_numbers
from workbench.session.journal import JOURNAL


def test_five_numbers_of_the_reference_session() -> None:
    session = record()
    assert session.calibration is not None
    assert session.fit is not None
    numbers = key_numbers(
        session, session.calibration, range_uncertainties(session.calibration, table_mm(session.calibration))
    )
    assert len(numbers) == 5
    assert numbers[0].value == "150 to 900 mm"
    assert numbers[3].value == f"{session.fit.rms_px:.3f} px"
    errors = {
        mm: [e.error_mm for e in session.events(ev.ReadingTaken) if e.standoff_mm == mm] for mm in (180, 500)
    }
    worst = max((sum(e for e in found if e is not None) / 3 / mm for mm, found in errors.items()), key=abs)
    assert numbers[4].value == f"{100 * worst:+.2f} %"


def test_the_largest_uncertainty_is_that_of_the_whole_certified_span() -> None:
    session = record()
    assert session.calibration is not None
    found = range_uncertainties(session.calibration, table_mm(session.calibration))
    dense = range_uncertainties(session.calibration, curve_mm(session.calibration))
    largest = max(2 * one.mean_sd_mm / one.range_mm for one in dense if one.mean_sd_mm is not None)
    stated = float(key_numbers(session, session.calibration, found)[2].value.removesuffix(" %"))
    assert stated == pytest.approx(100 * largest, rel=0.05), "two digits"


def test_without_calibration_the_numbers_are_dashes(tmp_path: Path) -> None:
    session = copied(tmp_path)
    (session / JOURNAL).unlink()
    assert [one.value for one in key_numbers(read_session(session), None, ())] == ["-"] * 5
