"""Section on calibrations: ranges and parameters against the first one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.reference_session import copied
from tests.unit.report.certificate.test_predecessor import shifted
from workbench.report.history.calibration_section import calibration_section
from workbench.report.history.in_force import dated_calibrations
from workbench.session.index import indexed_sessions


def test_changes_are_relative_to_the_first_calibration(tmp_path: Path) -> None:
    copied(tmp_path, "a")
    ((first,), _) = dated_calibrations(indexed_sessions(tmp_path))
    second = replace(first, session="b", calibration=shifted(first.calibration, 2.0))
    section = calibration_section([first, second])
    rows = section.tables[0].records()
    assert rows[0]["change.200"] is None
    assert [rows[1][f"change.{mm}"] for mm in (200, 500)] == pytest.approx([-0.01, -0.004], rel=1e-3)
    changes, parameters = section.charts
    assert [one.name for one in changes.series] == ["200 mm", "500 mm"]
    assert parameters.series[0].name == "offset_mm"
    assert calibration_section([]).tables == ()
    assert calibration_section([first]).charts == ()
