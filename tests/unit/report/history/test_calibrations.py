"""Change of ranges between two calibrations, in mm."""

from __future__ import annotations

import pytest

from tests.support.reference_session import record
from tests.unit.report.certificate.test_predecessor import shifted
from workbench.report.history.calibrations import compared, range_changes


def test_the_change_is_that_of_the_ranges_in_mm() -> None:
    calibration = record().calibration
    assert calibration is not None
    changes = range_changes(calibration, shifted(calibration, 2.0))
    assert [change.range_mm for change in changes] == [200.0, 500.0]
    assert [change.change_mm for change in changes] == pytest.approx([-2.0, -2.0], abs=1e-6)
    assert all(change.sd_mm > 0 for change in changes)
    comparison = compared(calibration, shifted(calibration, 2.0))
    assert comparison is not None
    assert not comparison.identical
