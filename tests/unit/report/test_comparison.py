"""Comparison of two sessions as a document."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.reference_session import REFERENCE, record
from workbench.calibration.verdict.comparison import Difference, compare
from workbench.model.errors import BadInputError
from workbench.report import comparison
from workbench.report.certificate.session_record import read_session
from workbench.report.comparison import comparison_document

DATA = REFERENCE.parents[1]


def test_a_session_compared_with_itself_has_no_difference() -> None:
    document = comparison_document(record(), record())
    assert document.verdict.tone == "good"
    (ranges,) = document.sections[0].tables
    cells = [v for row in ranges.records() for k, v in row.items() if "sd" not in k and k != "range_mm"]
    assert max(abs(float(v)) for v in cells if v is not None) < 1e-6
    parameters = document.sections[1].tables[0].records()
    assert {row["change"] for row in parameters} == {0.0}


def test_the_largest_difference_is_that_in_mm(monkeypatch: pytest.MonkeyPatch) -> None:
    calibration = record().calibration
    assert calibration is not None
    pair = (Difference("L1", 500.0, -3.0, 3.0), Difference("L2", 500.0, 1.0, 0.1))
    found = replace(compare(calibration, calibration), differences=pair)
    monkeypatch.setattr(comparison, "compare", lambda *_: found)
    assert comparison_document(record(), record()).key_numbers[2].value == "-3.00 mm"


@pytest.mark.parametrize("name", ["simulation-0.1.0", "session-0.1.0"])
def test_sessions_without_calibration_or_of_another_sensor_are_refused(name: str) -> None:
    with pytest.raises(BadInputError):
        comparison_document(record(), read_session(Path(DATA / name)))
