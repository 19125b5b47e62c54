"""Record of sensors: entries by serial number, in order."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import pytest

from workbench.model.errors import BadInputError
from workbench.session.sensor_log import SENSOR_LOG, SensorEntry, append_entry, read_entries


def entry(serial: str, text: str, kind: Literal["note", "in_force"] = "note") -> SensorEntry:
    return SensorEntry(serial=serial, kind=kind, time="2026-11-30T08:00:00+0000", operator="me", text=text)


def test_entries_of_a_sensor_are_read_in_order(tmp_path: Path) -> None:
    assert read_entries(tmp_path, "a/1") == []
    written = [entry("a/1", "first\nline"), entry("b", "other"), entry("a/1", "third", "in_force")]
    for one in written:
        append_entry(tmp_path, one)
    assert read_entries(tmp_path, "a/1") == [written[0], written[2]]


def test_a_damaged_line_is_named(tmp_path: Path) -> None:
    append_entry(tmp_path, entry("a", "first"))
    with (tmp_path / SENSOR_LOG).open("a") as file:
        file.write("damaged\n")
    with pytest.raises(BadInputError, match=f"{SENSOR_LOG}:2"):
        read_entries(tmp_path, "a")


def test_a_folder_that_cannot_be_written_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=SENSOR_LOG):
        append_entry(tmp_path / "missing", entry("a", "first"))


def test_nothing_is_appended_to_a_damaged_record(tmp_path: Path) -> None:
    path = tmp_path / SENSOR_LOG
    path.write_text("damaged\n")
    with pytest.raises(BadInputError, match=f"{SENSOR_LOG}:1"):
        append_entry(tmp_path, entry("a", "first"))
    assert path.read_text() == "damaged\n"


def test_a_note_may_have_any_separator_of_lines(tmp_path: Path) -> None:
    written = [entry("a", "lens\u2028cleaned\x85twice"), entry("a", "again")]
    for one in written:
        append_entry(tmp_path, one)
    assert read_entries(tmp_path, "a") == written
