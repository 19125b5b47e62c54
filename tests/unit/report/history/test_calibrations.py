"""Calibrations of a sensor: which is in force, and the change of ranges in mm."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.support.reference_session import SERIAL, copied, edit_calibration
from tests.unit.report.certificate.test_predecessor import shifted
from workbench.model.contents import file_sha256
from workbench.model.errors import BadInputError
from workbench.report.history.calibrations import compared, dated_calibrations, in_force, range_changes
from workbench.session.index import indexed_sessions
from workbench.session.sensor_log import SensorEntry


def chosen(path: str, sha256: str) -> SensorEntry:
    return SensorEntry(
        serial=SERIAL,
        kind="in_force",
        time="2027-01-04T08:00:00+0000",
        operator="me",
        text="the newer one is worse",
        path=path,
        sha256=sha256,
    )


def test_the_newest_calibration_is_in_force_until_one_is_chosen(tmp_path: Path) -> None:
    old, _ = copied(tmp_path, "a"), copied(tmp_path, "b")
    found, remarks = dated_calibrations(indexed_sessions(tmp_path))
    assert ([one.session for one in found], remarks) == (["a", "b"], [])
    newest = in_force(tmp_path, found, [])
    assert newest is not None
    assert (newest.calibration.session, newest.since) == ("b", "2026-11-30")
    entry = chosen("a/calibration.yaml", file_sha256(old / "calibration.yaml"))
    force = in_force(tmp_path, found, [entry])
    assert force is not None
    assert (force.calibration.session, force.since, force.why) == ("a", "2027-01-04", entry.text)


def test_a_calibration_that_changed_since_is_refused(tmp_path: Path) -> None:
    copied(tmp_path, "a")
    with pytest.raises(BadInputError, match="changed"):
        in_force(tmp_path, [], [chosen("a/calibration.yaml", "0" * 64)])


@pytest.mark.parametrize("damage", [edit_calibration, lambda s: (s / "calibration.yaml").unlink()])
def test_an_edited_or_missing_calibration_is_a_remark(tmp_path: Path, damage: Callable[[Path], None]) -> None:
    damage(copied(tmp_path, "a"))
    found, remarks = dated_calibrations(indexed_sessions(tmp_path))
    assert found == []
    assert len(remarks) == 1


def test_the_change_is_that_of_the_ranges_in_mm(tmp_path: Path) -> None:
    copied(tmp_path, "a")
    ((one,), _) = dated_calibrations(indexed_sessions(tmp_path))
    changes = range_changes(one.calibration, shifted(one.calibration, 2.0))
    assert [change.range_mm for change in changes] == [200.0, 500.0]
    assert [change.change_mm for change in changes] == pytest.approx([-2.0, -2.0], abs=1e-6)
    assert all(change.sd_mm > 0 for change in changes)
    comparison = compared(one.calibration, shifted(one.calibration, 2.0))
    assert comparison is not None
    assert not comparison.identical
