"""Calibration in force: the newest accepted one until one is chosen; a newer one is a remark."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.support.reference_session import SERIAL, copied, edit_calibration, repair, repeated
from workbench.model.contents import file_sha256
from workbench.model.errors import BadInputError
from workbench.report.history.in_force import dated_calibrations, in_force, newer_text, sensor_in_force
from workbench.session.index import indexed_sessions
from workbench.session.sensor_log import SensorEntry, append_entry


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
    old, _ = copied(tmp_path, "a"), repeated(tmp_path, "b", days=1)
    found, remarks = dated_calibrations(indexed_sessions(tmp_path))
    assert ([one.session for one in found], remarks) == (["a", "b"], [])
    newest = in_force(tmp_path, found, [])
    assert newest is not None
    assert (newest.calibration.session, newest.since) == ("b", "2026-12-01")
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


def test_calibrations_are_in_order_of_time_not_of_names(tmp_path: Path) -> None:
    repeated(tmp_path, "a", days=1)
    copied(tmp_path, "b")
    found, _ = dated_calibrations(indexed_sessions(tmp_path))
    assert [one.session for one in found] == ["b", "a"]
    force = sensor_in_force(tmp_path, SERIAL)
    assert force is not None
    assert force.calibration.session == "a"


def test_a_copy_of_a_session_is_no_other_calibration(tmp_path: Path) -> None:
    copied(tmp_path, "a")
    copied(tmp_path, "b")
    (tmp_path / "c").symlink_to("a")
    found, _ = dated_calibrations(indexed_sessions(tmp_path))
    assert [one.session for one in found] == ["a"]


@pytest.mark.parametrize(("chosen_name", "is_newest"), [("a", False), ("b", True)])
def test_a_newer_calibration_than_the_chosen_one_is_a_remark(
    tmp_path: Path, chosen_name: str, is_newest: bool
) -> None:
    copied(tmp_path, "a")
    repeated(tmp_path, "b", days=1)
    path = f"{chosen_name}/calibration.yaml"
    append_entry(tmp_path, chosen(path, file_sha256(tmp_path / path)))
    found, _ = dated_calibrations(indexed_sessions(tmp_path))
    force = sensor_in_force(tmp_path, SERIAL)
    assert force is not None
    assert force.calibration.session == chosen_name
    assert (newer_text(force, found) == "") == is_newest


def test_a_sensor_without_calibration_has_none_in_force(tmp_path: Path) -> None:
    copied(tmp_path, "a")
    assert sensor_in_force(tmp_path, "other") is None
    assert newer_text(None, []) == ""


def dated(folder: Path, name: str, began: str) -> Path:
    """Copy of the session with another calibration and start time in its manifest."""
    session = repeated(folder, name, days=1)
    manifest = session / "session.yaml"
    manifest.write_text(manifest.read_text().replace("2026-12-01T08:50:45+0000", began))
    return session


@pytest.mark.parametrize("began", ["9999-12-31T23:59:59+0000", "2026-12-09T08:50:45+0000", "zzzz", "'0'"])
def test_a_start_that_cannot_be_right_is_not_used_but_named(tmp_path: Path, began: str) -> None:
    copied(tmp_path, "a")
    wrong = dated(tmp_path, "b", began)
    found, remarks = dated_calibrations(indexed_sessions(tmp_path))
    assert [one.session for one in found] == ["a"]
    (remark,) = remarks
    assert str(wrong / "session.yaml") in remark
    force = sensor_in_force(tmp_path, SERIAL)
    assert force is not None
    assert force.calibration.session == "a"


def test_a_session_in_the_future_is_in_force_only_without_another(tmp_path: Path) -> None:
    future = repeated(tmp_path, "b", days=200 * 365)
    force = sensor_in_force(tmp_path, SERIAL)
    assert force is not None
    assert force.calibration.session == future.name
    copied(tmp_path, "a")
    force = sensor_in_force(tmp_path, SERIAL)
    assert force is not None
    assert force.calibration.session == "a"
    found, _ = dated_calibrations(indexed_sessions(tmp_path))
    assert newer_text(force, found) == ""


@pytest.mark.parametrize("verdict", ["refused", "accepted"])
def test_a_repair_after_the_choice_is_a_remark(tmp_path: Path, verdict: str) -> None:
    session = copied(tmp_path, "a")
    append_entry(tmp_path, chosen("a/calibration.yaml", file_sha256(session / "calibration.yaml")))
    before = sensor_in_force(tmp_path, SERIAL)
    assert before is not None
    assert (before.remark, before.refused) == ("", False)
    repair(session, verdict)
    force = sensor_in_force(tmp_path, SERIAL)
    assert force is not None
    assert force.calibration.session == "a"
    assert force.remark
    assert force.refused == (verdict == "refused")
