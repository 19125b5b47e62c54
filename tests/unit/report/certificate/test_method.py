"""Sections on procedures, decisions and deviations."""

from __future__ import annotations

from pathlib import Path

from tests.support.reference_session import REFERENCE, copied, record
from tests.support.verified_sensor import reading
from workbench.model import event as ev
from workbench.report.certificate.method import decision_section, exception_section, procedure_section
from workbench.report.certificate.session_record import read_session, text_sha256
from workbench.session.journal import JOURNAL

FIT_LIMITS = 5


def test_procedures_have_their_hash_and_steps_their_outcome() -> None:
    files, steps = procedure_section(record()).tables
    text = record().manifest.procedures[0].text
    assert files.records() == [{"file": "reference.yaml", "sha256": text_sha256(text)}]
    assert [row["index"] for row in steps.records()] == [1, 2, 3, 4, 5, 6]
    assert steps.records()[0]["outcome"] == "21.5 deg C"


def test_every_checked_limit_is_listed_with_the_decision_rule() -> None:
    section = decision_section(record(), record().calibration)
    (table,) = section.tables
    assert len(table.rows) == len(record().events(ev.LimitChecked)) + FIT_LIMITS
    assert {row["verdict"] for row in table.records()} == {"pass"}
    assert "ISO 14253-1" in section.texts[0]


def test_repairs_and_rejections_are_listed_with_their_reasons() -> None:
    names = {table.name: table.records() for table in exception_section(record()).tables}
    kinds = [row["kind"] for row in names["repeated"]]
    assert kinds == ["repair", "resumed"]
    assert "target was not square" in str(names["repeated"][0]["text"])


def test_missing_readings_and_incidents_are_listed(tmp_path: Path) -> None:
    session = copied(tmp_path)
    lost = reading(500.0, 9, 0.0).model_copy(update={"range_mm": None, "status": "no_points"})
    events: list[ev.Event] = [*[lost] * 5, ev.Incident(of="the recording", message="disk full")]
    count = len(record().all_records)
    with (session / JOURNAL).open("a") as journal:
        for n, event in enumerate(events, start=count):
            journal.write(ev.Record(n=n, time_ns=10**18, event=event).model_dump_json() + "\n")
    names = {table.name: table.records() for table in exception_section(read_session(session)).tables}
    (missing,) = names["missing_readings"]
    assert (missing["trial"], missing["true_mm"], missing["count"]) == ("verify.1", 500.0, 5)
    assert [row["message"] for row in names["incidents"]] == ["disk full"]


def test_a_session_without_deviations_states_that() -> None:
    section = exception_section(read_session(REFERENCE.parents[1] / "simulation-0.1.0"))
    assert section.tables == ()
    assert len(section.texts) == 1
