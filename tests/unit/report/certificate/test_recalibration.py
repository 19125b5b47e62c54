"""Next calibration: a date only where an interval was agreed."""

from __future__ import annotations

from datetime import date

import pytest

from tests.support.reference_session import LABORATORY, record
from workbench.model.laboratory import Laboratory
from workbench.report.certificate.recalibration import months_later, recalibration_section


@pytest.mark.parametrize(
    ("day", "months", "expected"),
    [
        (date(2026, 11, 30), 12, date(2027, 11, 30)),
        (date(2026, 11, 30), 3, date(2027, 2, 28)),
        (date(2027, 12, 31), 2, date(2028, 2, 29)),
        (date(2026, 12, 1), 1, date(2027, 1, 1)),
    ],
)
def test_months_end_at_the_last_day_of_a_short_month(day: date, months: int, expected: date) -> None:
    assert months_later(day, months) == expected


def test_an_agreed_interval_gives_a_date_with_its_reason() -> None:
    facts = {fact.name: fact.value for fact in recalibration_section(LABORATORY, record().calibration).facts}
    assert facts["Recommended date"].startswith("2027-11-30")
    assert facts["Reason"] == "agreed"


def test_no_interval_gives_no_date() -> None:
    assert recalibration_section(Laboratory(format=1), record().calibration).facts == ()
    assert recalibration_section(LABORATORY, None).facts == ()
