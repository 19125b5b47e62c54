"""Sections on procedures, decisions and deviations."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.reference_session import LABORATORY, REFERENCE, certificate, copied, record, repair
from tests.support.verified_sensor import reading
from workbench.model import event as ev
from workbench.model.prompt import Answer
from workbench.report.certificate.identity import OVERRULED, conditions_section
from workbench.report.certificate.method import decision_section, exception_section, procedure_section
from workbench.report.certificate.session_record import read_session, text_sha256
from workbench.session.journal import JOURNAL, Journal

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


KEPT = ev.Answered(
    key="reference.3/150mm/standoff",
    question="The spots at 150 mm fit a standoff of 159.0 +- 0.5 mm. Keep these captures?",
    answer=Answer(reason="measured with a calliper"),
    overrules=True,
)


@pytest.mark.parametrize("repaired", [False, True])
def test_an_overruled_warning_stays_with_its_reason_also_after_a_repair(
    tmp_path: Path, repaired: bool
) -> None:
    session = copied(tmp_path)
    journal, _ = Journal.reopen(session)
    with journal:
        journal.append(KEPT)
        journal.append(ev.SessionFinished(exit_code=0, message="done"))
    if repaired:
        repair(session, "accepted")
    found = read_session(session)
    names = {table.name: table.records() for table in exception_section(found).tables}
    (row,) = names["overruled"]
    assert (row["warning"], row["reason"], row["by"]) == (KEPT.question, KEPT.answer.reason, "person")
    assert (row["state"] == "in effect") == (not repaired)
    assert any(KEPT.question in reason for reason in certificate(session=found).document.verdict.reasons)


def test_an_answer_that_a_repair_journals_again_is_one_overruled_warning(tmp_path: Path) -> None:
    session = copied(tmp_path)
    journal, _ = Journal.reopen(session)
    with journal:
        journal.append(KEPT)
    repair(session, "accepted")
    journal, _ = Journal.reopen(session)
    with journal:
        journal.append(KEPT)
    (row,) = read_session(session).overruled
    assert row.in_effect


def test_the_answers_name_an_overruled_warning(tmp_path: Path) -> None:
    session = copied(tmp_path)
    journal, _ = Journal.reopen(session)
    with journal:
        journal.append(KEPT)
    (table,) = conditions_section(LABORATORY, read_session(session)).tables
    answers = {row["question"]: str(row["answer"]) for row in table.records()}
    assert answers[KEPT.question] == f"{OVERRULED} ({KEPT.answer.reason})"


def test_the_step_that_ended_a_refused_session_states_why_and_no_verdict_is_empty() -> None:
    session = read_session(REFERENCE.parent / "20261130-120758-bad-standoff")
    _, steps = procedure_section(session).tables
    fit = steps.records()[-1]
    assert str(fit["outcome"]).startswith("failed: ")
    assert "600 mm" in str(fit["outcome"])
    (limits,) = decision_section(session, session.calibration).tables
    assert all(row["verdict"] for row in limits.records())
