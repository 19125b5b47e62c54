"""Title, verdict and conformity: equal in every format, and a pass only if nothing stands against it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.dcc_reader import parsed
from tests.support.reference_session import LABORATORY, certificate, copied, record
from tests.unit.report.certificate.test_dcc import NAMES, PRINTED
from workbench.model import event as ev
from workbench.model.table import Column, Table
from workbench.report.certificate.assessment import CERTIFICATE, REPORT, assess, future_texts
from workbench.report.certificate.dcc import certificate_xml
from workbench.report.certificate.method import decision_section
from workbench.report.certificate.session_record import SessionRecord, read_session
from workbench.session.journal import JOURNAL


def with_events(*added: ev.Event) -> SessionRecord:
    """The session with further events before its end."""
    session = record()
    *first, last = session.all_records
    new = [ev.Record(n=len(first) + n, time_ns=last.time_ns, event=event) for n, event in enumerate(added)]
    return replace(session, all_records=(*first, *new, last))


def with_table(columns: tuple[str, ...], *rows: tuple[str | float, ...]) -> SessionRecord:
    """The session with a trial `p.1` that ends with this verdict."""
    keys = tuple(Column(key=key, name=key) for key in columns)
    table = Table(name="p.1-verdict", title="Verdict", columns=keys, rows=rows)
    return with_events(ev.TrialFinished(trial="p.1", tables=(table,), charts=()))


def refitted() -> SessionRecord:
    """The session with a second fit, which is refused."""
    fit = record().fit
    assert fit is not None
    return with_events(fit.model_copy(update={"verdict": "refused", "reasons": ("too few standoffs",)}))


def limit(verdict: str) -> ev.LimitChecked:
    return ev.LimitChecked.model_validate(
        {"step": "p.1", "of": "500 mm", "quantity": "error_mm", "value": 1, "limit": "x", "verdict": verdict}
    )


def test_an_accepted_calibration_is_good() -> None:
    found = assess(record(), record().calibration)
    assert (found.title, found.verdict.tone, found.conformity) == (CERTIFICATE, "good", "pass")
    assert found.verdict.reasons[0].startswith("reference.6: ")


def unfinished() -> SessionRecord:
    session = record()
    return replace(session, status=replace(session.status, state="stopped"))


@pytest.mark.parametrize(
    ("session", "title", "tone", "conformity"),
    [
        (refitted(), REPORT, "bad", "fail"),
        (unfinished(), REPORT, "open", "noPass"),
        (with_table(("valid",), ("NO",)), CERTIFICATE, "bad", "fail"),
        (with_table(("valid",), ("yes",)), CERTIFICATE, "good", "pass"),
        (with_table(("range", "p"), ("mean", 0.9), ("closest", 0.024)), CERTIFICATE, "bad", "fail"),
        (with_table(("range", "p"), ("mean", 0.9), ("closest", 0.026)), CERTIFICATE, "good", "pass"),
        (with_events(limit("marginal")), CERTIFICATE, "open", "noPass"),
        (with_events(limit("fail"), limit("marginal")), CERTIFICATE, "bad", "fail"),
    ],
)
def test_page_and_digital_certificate_state_the_same(
    session: SessionRecord, title: str, tone: str, conformity: str
) -> None:
    found = certificate(LABORATORY, session=session)
    assert (found.document.title, found.document.verdict.tone) == (title, tone)
    root = parsed(certificate_xml(found, PRINTED))
    assert root.findtext(".//dcc:conformity", "", NAMES) == conformity


def test_a_refused_fit_names_its_reasons() -> None:
    session = refitted()
    assert assess(session, session.calibration).verdict.reasons[0] == "too few standoffs"


@pytest.mark.parametrize("verdict", ["fail", "marginal"])
def test_limits_that_are_not_met_are_named_up_to_four(verdict: str) -> None:
    session = with_events(*[limit(verdict)] * 6)
    reasons = assess(session, session.calibration).verdict.reasons
    assert len(reasons) == 4 + 1 + 1, "limits, number of others, outcome of the trial"
    assert "error_mm" in reasons[3]
    assert reasons[4].startswith("2 ")


@pytest.mark.parametrize("last", [0, 10])
def test_a_session_that_was_cut_is_open(tmp_path: Path, last: int) -> None:
    session = copied(tmp_path)
    lines = (session / JOURNAL).read_text().splitlines(keepends=True)
    (session / JOURNAL).write_text("".join(lines[:last]))
    assert assess(read_session(session), None).verdict.tone == "open"


@pytest.mark.parametrize(("valid", "tone", "verdict"), [("yes", "good", "pass"), ("NO", "bad", "fail")])
def test_a_verification_is_the_headline_and_a_decision(valid: str, tone: str, verdict: str) -> None:
    """Of a session with an existing calibration and nothing but a verification."""
    verified = with_table(("valid", "verdict"), (valid, "the ranges"))
    kept = ev.SessionStarted | ev.TrialFinished | ev.SessionFinished
    records = tuple(one for one in verified.all_records if isinstance(one.event, kept))
    session = replace(verified, all_records=tuple(one for one in records if not _is_own_trial(one)))
    calibration = record().calibration
    found = assess(session, calibration)
    assert (found.title, found.verdict.tone, found.conformity) == (REPORT, tone, verdict)
    assert found.verdict.text.startswith("Verification")
    (table,) = decision_section(session, calibration).tables
    assert [row["verdict"] for row in table.records()] == [verdict]


def _is_own_trial(one: ev.Record) -> bool:
    return isinstance(one.event, ev.TrialFinished) and one.event.trial != "p.1"


def test_dates_in_the_future_are_reasons_of_the_verdict(tmp_path: Path) -> None:
    session = copied(tmp_path)
    manifest = session / "session.yaml"
    before = record(session)
    assert list(future_texts(before, before.calibration)) == []
    manifest.write_text(manifest.read_text().replace("2026-11-30T08:50:45+0000", "2999-11-30T08:50:45+0000"))
    after = record(session)
    (remark,) = future_texts(after, after.calibration)
    assert session.name in remark
    assert remark in assess(after, after.calibration).verdict.reasons
    assert after.calibration is not None
    made = after.calibration.laser_ranger.provenance.model_copy(
        update={"created": "2999-01-01T00:00:00+0000"}
    )
    ranger = after.calibration.laser_ranger.model_copy(update={"provenance": made})
    calibration = after.calibration.model_copy(update={"laser_ranger": ranger})
    assert len(list(future_texts(after, calibration))) == 2
