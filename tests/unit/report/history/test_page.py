"""Verdict of a history: in control, drifted, or not known yet; next calibration by the earliest rule."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from tests.support.reference_session import SERIAL
from tests.support.verified_sensor import FIRST, MONTH, reading, verified_sensor, write_verification
from tests.unit.trials.verify.test_tables import REFERENCE, SENSOR
from workbench.cli.history import sensor_history
from workbench.model import event as ev
from workbench.report.history.page import SensorHistory, history_document, of_one_calibration, recalibrate_by
from workbench.session.index import indexed_sessions
from workbench.session.journal import JOURNAL
from workbench.session.sensor_log import SensorEntry, append_entry
from workbench.trials.verify.tables import verify_tables
from workbench.trials.verify.verdict import Verdict


def history(folder: Path, sessions: int, drift: float = 0.0, months: int | None = None) -> SensorHistory:
    errors = np.random.default_rng(7).normal(0.0, 0.001, (sessions, 3))
    errors[10:, 1] += drift * np.arange(1, max(sessions - 10, 0) + 1)
    verified_sensor(folder, errors)
    if months is not None:
        (folder / "lab.yaml").write_text(f"format: 1\nrecalibration: {{months: {months}, reason: agreed}}\n")
    return sensor_history(folder, SERIAL, indexed_sessions(folder))


@pytest.mark.parametrize(
    ("sessions", "drift", "tone"), [(5, 0, "open"), (24, 0, "good"), (24, 0.0004, "bad")]
)
def test_verdict(tmp_path: Path, sessions: int, drift: float, tone: str) -> None:
    document = history_document(history(tmp_path, sessions, drift))
    assert document.verdict.tone == tone
    assert any("at 400 mm since" in reason for reason in document.verdict.reasons) == (tone == "bad")


@pytest.mark.parametrize(("error", "tone"), [(0.05, "bad"), (0.0045, "open"), (0.001, "good")])
def test_an_error_from_the_first_verification_is_seen(tmp_path: Path, error: float, tone: str) -> None:
    # U is 0.36 % at 200 mm, 0.25 % at 400 mm.
    errors = np.random.default_rng(7).normal(0.0, 0.0002, (12, 3))
    errors[:, 0] += error
    verified_sensor(tmp_path, errors)
    found = sensor_history(tmp_path, SERIAL, indexed_sessions(tmp_path))
    assert history_document(found).verdict.tone == tone
    assert (recalibrate_by(found) is not None) == (tone == "bad")


def tone(folder: Path) -> str:
    return history_document(sensor_history(folder, SERIAL, indexed_sessions(folder))).verdict.tone


@pytest.mark.parametrize("measured", [True, False])
def test_a_verification_that_ended_not_valid_counts_until_a_valid_one(tmp_path: Path, measured: bool) -> None:
    history(tmp_path, 12)
    path = write_verification(tmp_path, FIRST + 20 * MONTH, [[0.001]] * 3 if measured else [])
    journal = path / "journal.jsonl"
    lines = journal.read_text().splitlines()
    if not measured:
        one = ev.Record(n=len(lines), time_ns=int(1.9e18), event=reading(600.0, 0, 0.0))
        lines.append(one.model_dump_json().replace('"reference_sd_mm":0.3', '"reference_sd_mm":600.0'))
    tables = tuple(verify_tables("verify", SENSOR, (REFERENCE, ()), Verdict(False, "wrong", "act")))
    finished = ev.TrialFinished(trial="verify", tables=tables)
    lines.append(ev.Record(n=len(lines), time_ns=int(1.9e18), event=finished).model_dump_json())
    journal.write_text("".join(f"{line}\n" for line in lines))
    assert tone(tmp_path) == "bad"
    write_verification(tmp_path, FIRST + 70 * MONTH, [[0.001]] * 3)
    assert tone(tmp_path) == "good"


def test_a_distance_that_a_session_lacks_is_named_and_an_alarm_stays(tmp_path: Path) -> None:
    history(tmp_path, 24, 0.0004)
    write_verification(tmp_path, FIRST + 30 * MONTH, [[0.001, 0.002]])
    for n in range(40):
        write_verification(tmp_path, FIRST + (31 + n) * MONTH, [[0.001, 0.002], [], [0.001, 0.002]])
    verdict = history_document(sensor_history(tmp_path, SERIAL, indexed_sessions(tmp_path))).verdict
    assert verdict.tone == "bad"
    assert any("400 mm" in reason and "42 sessions" in reason for reason in verdict.reasons)
    assert any("800 mm" in reason and "2 sessions" in reason for reason in verdict.reasons)


def test_sessions_without_a_chart_do_not_count_as_in_control(tmp_path: Path) -> None:
    history(tmp_path, 12)
    for n in range(5):
        path = write_verification(tmp_path, FIRST + (20 + n) * MONTH, [[0.001, 0.002]])
        journal = path / "journal.jsonl"
        journal.write_text(journal.read_text().replace('"standoff_mm":200.0', '"standoff_mm":1500.0'))
    verdict = history_document(sensor_history(tmp_path, SERIAL, indexed_sessions(tmp_path))).verdict
    assert verdict.text.endswith("over 2 sessions")
    assert any("1500 mm" in reason for reason in verdict.reasons)


def test_the_earliest_rule_gives_the_date(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    agreed = history(tmp_path / "a", 12, months=6)
    assert recalibrate_by(agreed) == (date(2027, 5, 30), "agreed interval of 6 months")
    (tmp_path / "b").mkdir()
    drifted = recalibrate_by(history(tmp_path / "b", 24, 0.0004, months=120))
    assert drifted is not None
    assert drifted[0] == date(2028, 11, 24)
    assert "alarm at 400 mm" in drifted[1]


def test_charts_of_each_distance_and_notes_are_in_the_document(tmp_path: Path) -> None:
    history(tmp_path, 24)
    entry = SensorEntry(serial=SERIAL, kind="note", time="2027-01-01", operator="me", text="<b>cleaned</b>")
    append_entry(tmp_path, entry)
    found = history_document(sensor_history(tmp_path, SERIAL, indexed_sessions(tmp_path)))
    sections = {section.key: section for section in found.sections}
    names = {chart.name for chart in sections["verifications"].charts}
    assert names == {f"{kind}_{mm}mm" for kind in ("xbar", "s", "cusum") for mm in (200, 400, 800)}
    assert sections["notes"].tables[0].records()[0]["text"] == entry.text
    json.dumps(found.as_json())


@pytest.mark.parametrize("sessions", [0, 3, 24])
def test_without_a_calibration_in_force_no_verification_counts_for_it(tmp_path: Path, sessions: int) -> None:
    """The session of the calibration is damaged: verifications are compared with each other only."""
    history(tmp_path, sessions)
    journal = next(tmp_path.glob("*-reference")) / JOURNAL
    lines = journal.read_text().splitlines(keepends=True)
    journal.write_text("".join([*lines[:5], *lines[6:]]))
    damaged = sensor_history(tmp_path, SERIAL, indexed_sessions(tmp_path))
    document = history_document(damaged)
    head = {fact.name: fact.value for fact in document.head}
    assert (head["Calibration in force"], head["Verifications with it"]) == ("none", "0")
    assert len(damaged.verifications) == sessions
    assert document.verdict.tone == "open"
    assert "in force" not in document.verdict.text or "no calibration" in document.verdict.text.lower()
    assert any(JOURNAL in reason for reason in document.verdict.reasons)


def test_verifications_of_one_calibration_are_compared(tmp_path: Path) -> None:
    first, *others = history(tmp_path, 4).verifications
    assert of_one_calibration((), None) == ()
    assert len(of_one_calibration((replace(first, calibration="another"), *others), None)) == len(others)
