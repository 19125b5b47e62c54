"""Title, verdict and conformity of a session's certificate, decided in one place."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from workbench.model import event as ev
from workbench.model.calibration import Calibration
from workbench.model.dates import future_remark
from workbench.model.number_text import counted
from workbench.model.table import Table
from workbench.report.certificate.fit_limits import Row, limit_rows
from workbench.report.certificate.session_record import SessionRecord
from workbench.report.document import Verdict
from workbench.trials.accuracy.verdict import BIAS_ALARM, joint_probability

CERTIFICATE, REPORT = "Calibration certificate", "Measurement report"
MOST_LIMITS = 4
"""Largest number of failed or marginal limits that the verdict names."""


@dataclass(frozen=True)
class Assessment:
    """Outcome of a session, as all formats of its certificate state it."""

    title: str
    verdict: Verdict
    conformity: Literal["pass", "fail", "noPass"] | None
    """Statement of conformity, by the names of the Digital Calibration Certificate; None: no limit."""
    limits: int
    """Number of limits with a verdict."""


def assess(session: SessionRecord, calibration: Calibration | None) -> Assessment:
    """Assessment of the session: its calibration, its limits, its trials.

    A refused fit, an invalid verification, or a session that is not finished never passes.
    """
    rows = [row for row in limit_rows(session, calibration) if row[-1]]
    verdict = _verdict(session, calibration, rows)
    has_failed = verdict.tone == "bad" or _with(rows, "fail")
    conformity: Literal["pass", "fail", "noPass"]
    conformity = "fail" if has_failed else "pass" if verdict.tone == "good" else "noPass"
    is_certificate = (
        calibration is not None
        and session.is_own_calibration
        and session.status.state == "finished"
        and not _is_refused(session, calibration)
    )
    title = CERTIFICATE if is_certificate else REPORT
    return Assessment(title, verdict, conformity if rows else None, len(rows))


def _verdict(session: SessionRecord, calibration: Calibration | None, rows: Sequence[Row]) -> Verdict:
    fit, state = session.fit, session.status.state
    is_refused = fit is not None and fit.verdict == "refused"
    failed = [row for row in _with(rows, "fail") if not (is_refused and row[1] == "fit")]
    dates = future_texts(session, calibration)
    reasons = (*_named(failed), *_overruled(session), *_trial_outcomes(session), *dates)
    if fit is not None and _is_refused(session, calibration):
        return Verdict("bad", "Calibration refused", (*fit.reasons, *reasons))
    if _has_invalid_verification(session):
        return Verdict("bad", "Verification: the calibration is not valid", reasons)
    if state != "finished":
        why = session.status.why or state
        return Verdict("bad" if failed else "open", f"Session {state}: {why}", reasons)
    if _has_biased_accuracy(session):
        return Verdict("bad", "Errors exceed the stated uncertainty", reasons)
    if calibration is not None and calibration.laser_ranger.fit.verdict == "refused":
        ours = calibration.laser_ranger.fit
        because = f"accepted in spite of failed limits because: {ours.accepted_because}"
        text = "Calibration accepted with a reason, although limits failed"
        return Verdict("open", text, (because, *ours.reasons, *reasons))
    if failed:
        return Verdict("bad", "A limit failed", reasons)
    if marginal := _with(rows, "marginal"):
        return Verdict("open", "A result is marginal", (*_named(marginal), *reasons))
    if calibration is None:
        return Verdict("open", "No calibration in this session", reasons)
    return Verdict("good", _good_text(session), reasons)


def _good_text(session: SessionRecord) -> str:
    if session.is_own_calibration:
        return "Calibration accepted"
    if any(one.verification is not None for one in session.events(ev.TrialFinished)):
        return "Verification: the calibration is valid"
    return "Measured with an accepted calibration"


def _is_refused(session: SessionRecord, calibration: Calibration | None) -> bool:
    """Whether the last fit was refused, and not accepted with a reason."""
    if session.fit is None or session.fit.verdict != "refused":
        return False
    # A calibration of an earlier fit, or an existing one, is no acceptance of the last fit.
    if calibration is None or not session.is_own_calibration:
        return True
    return calibration.laser_ranger.fit.verdict != "refused"


def _with(rows: Sequence[Row], verdict: str) -> list[Row]:
    return [row for row in rows if row[-1] == verdict]


def _named(rows: Sequence[Row]) -> Iterator[str]:
    for step, of, quantity, _, limit, verdict in rows[:MOST_LIMITS]:
        yield f"{step}, {of}: {quantity} expected {limit}, {verdict}"
    if len(rows) > MOST_LIMITS:
        yield f"{counted(len(rows) - MOST_LIMITS, 'more limit')}: {rows[0][-1]}"


def _overruled(session: SessionRecord) -> Iterator[str]:
    for one in session.overruled[:MOST_LIMITS]:
        reason = f" ({one.reason})" if one.reason else ""
        yield f"{'overruled' if one.in_effect else 'overruled, results replaced since'}: {one.text}{reason}"
    if (more := len(session.overruled) - MOST_LIMITS) > 0:
        yield f"{counted(more, 'more warning')} overruled"


def future_texts(session: SessionRecord, calibration: Calibration | None) -> Iterator[str]:
    """Remarks on dates of the session and its calibration that are after now."""
    yield from filter(None, (future_remark(f"session {session.folder.name}", session.manifest.created),))
    if calibration is not None:
        made = calibration.laser_ranger.provenance.created
        yield from filter(None, (future_remark("the calibration", made),))


def _trial_outcomes(session: SessionRecord) -> Iterator[str]:
    trials = {one.trial for one in session.events(ev.TrialFinished)}
    for step in session.events(ev.StepFinished):
        if (name := f"{step.procedure}.{step.index}") in trials:
            yield f"{name}: {step.outcome}"


def _has_invalid_verification(session: SessionRecord) -> bool:
    last = {one.trial: one for one in session.events(ev.TrialFinished)}
    return any(one.refuses_calibration for one in last.values())


def _has_biased_accuracy(session: SessionRecord) -> bool:
    """Whether the errors of an accuracy trial exceed the stated uncertainty."""
    for table in _verdict_tables(session):
        found = [p for row in table.records() if isinstance(p := row.get("p"), float | int)]
        if found and joint_probability(found) < BIAS_ALARM:
            return True
    return False


def _verdict_tables(session: SessionRecord) -> Iterator[Table]:
    """Verdict of each trial, of its last run."""
    last = {one.trial: one.tables for one in session.events(ev.TrialFinished)}
    for trial, tables in last.items():
        yield from (table for table in tables if table.name == f"{trial}-verdict")
