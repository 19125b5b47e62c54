"""`workbench history`: verdict, page, notes; the sensor is named where there are several."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.support.command_line import Run, refused
from tests.support.reference_session import SERIAL, copied, repair
from tests.support.verified_sensor import verified_sensor


def test_drift_is_printed_and_written(workbench: Run, tmp_path: Path) -> None:
    errors = np.random.default_rng(7).normal(0.0, 0.001, (24, 3))
    errors[10:, 1] += 0.0004 * np.arange(1, 15)
    verified_sensor(tmp_path, errors)
    page = tmp_path / "page.html"
    done = workbench("history", "--sessions", tmp_path, "--html", page)
    assert done.code == 0
    assert "at 400 mm since" in done.out
    assert "recalibrate by 2028-11-24" in done.out
    assert page.exists()


def test_notes_are_kept_and_escaped(workbench: Run, tmp_path: Path) -> None:
    copied(tmp_path)
    page = tmp_path / "page.html"
    note = "<script>cleaned</script>"
    done = workbench(
        "history", "--sessions", tmp_path, "--rig", SERIAL, "--note", note, "--html", page, "--json"
    )
    assert done.code == 0
    notes = next(one for one in json.loads(done.out)["sections"] if one["key"] == "notes")
    assert [row["text"] for row in notes["tables"][0]["rows"]] == [note]
    assert note not in page.read_text()
    again = json.loads(workbench("history", "--sessions", tmp_path, "--json").out)
    assert again["serial"] == SERIAL


def test_notes_and_choices_name_the_person(workbench: Run, tmp_path: Path) -> None:
    session = copied(tmp_path)
    options = ("--rig", SERIAL, "--operator", "A. Person", "--sessions", tmp_path)
    assert workbench("use", session.name, "--reason", "x", *options).code == 0
    done = workbench("history", "--note", "cleaned", "--json", *options)
    notes = next(one for one in json.loads(done.out)["sections"] if one["key"] == "notes")
    assert [row["operator"] for row in notes["tables"][0]["rows"]] == ["A. Person", "A. Person"]


def test_control_characters_of_a_note_do_not_reach_the_terminal(workbench: Run, tmp_path: Path) -> None:
    copied(tmp_path)
    done = workbench("history", "--sessions", tmp_path, "--rig", SERIAL, "--note", "a\x1b[31mred\x07")
    assert done.code == 0
    assert not {"\x1b", "\x07"} & set(done.out + done.err)


def test_a_note_that_is_not_utf8_is_refused(workbench: Run, tmp_path: Path) -> None:
    copied(tmp_path)
    done = workbench("history", "--sessions", tmp_path, "--rig", SERIAL, "--note", "Pr\udcfcfung")
    refused(done, 2)
    assert not (tmp_path / "sensors.jsonl").exists()


def test_the_sensor_must_be_known(workbench: Run, tmp_path: Path) -> None:
    refused(workbench("history", "--sessions", tmp_path), 2, "--rig")
    copied(tmp_path)
    refused(workbench("history", "--sessions", tmp_path, "--rig", "other"), 2, SERIAL)
    other = copied(tmp_path, "other") / "session.yaml"
    other.write_text(other.read_text().replace("serial: reference-1", "serial: reference-2"))
    refused(workbench("history", "--sessions", tmp_path), 2, "reference-1", "reference-2")
    refused(workbench("history", "--sessions", tmp_path / "missing"), 2, "missing")
    missing = tmp_path / "missing/page.html"
    refused(workbench("history", "--sessions", tmp_path, "--rig", SERIAL, "--html", missing), 2, "page.html")


def test_a_calibration_in_force_that_a_repair_refused_is_bad(workbench: Run, tmp_path: Path) -> None:
    session = copied(tmp_path)
    chosen = workbench("use", session.name, "--rig", SERIAL, "--reason", "x", "--sessions", tmp_path)
    assert chosen.code == 0
    before = json.loads(workbench("history", "--sessions", tmp_path, "--json").out)
    repair(session, "refused")
    after = json.loads(workbench("history", "--sessions", tmp_path, "--json").out)
    assert (before["verdict"]["tone"], after["verdict"]["tone"]) == ("open", "bad")
    assert any(session.name in reason for reason in after["verdict"]["reasons"])
    again = workbench("use", session.name, "--rig", SERIAL, "--reason", "x", "--sessions", tmp_path)
    refused(again, 3, session.name)


@pytest.mark.parametrize("began", ["zzzz", "9999-12-31T23:59:59+0000"])
def test_a_session_with_a_wrong_date_is_named(workbench: Run, tmp_path: Path, began: str) -> None:
    session = copied(tmp_path)
    manifest = session / "session.yaml"
    manifest.write_text(manifest.read_text().replace("2026-11-30T08:50:45+0000", began))
    done = workbench("history", "--sessions", tmp_path, "--json")
    assert done.code == 0
    assert any("session.yaml" in reason for reason in json.loads(done.out)["verdict"]["reasons"])
