"""Sections on what was done: procedures, decisions, rejected and repeated captures, incidents."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from workbench.model import event as ev
from workbench.model.calibration import Calibration
from workbench.model.table import Cell, Column, Table
from workbench.report.certificate.fit_limits import limit_rows
from workbench.report.certificate.session_record import SessionRecord, text_sha256
from workbench.report.document import NOT_STATED, Fact, Section

DECISION_RULE = (
    "Decision rule (ISO 14253-1): a result with an uncertainty passes if its whole 95 % interval lies"
    " inside the limit, and fails if the whole interval lies outside; between them it is neither"
    " (marginal). Rms residual and other quantities without an uncertainty of their own are compared"
    " directly."
)
NOT_EVALUATED = "not evaluated: no calibration"
"""Verdict on a limit whose quantity only a calibration states: a refused fit exports none."""
NO_CLAIM = "The work follows the procedures named here. Conformity with no other standard is claimed."


def procedure_section(session: SessionRecord) -> Section:
    """Procedures with their hashes, and the outcome of each step."""
    started = {one.procedure: one.title for one in session.events(ev.ProcedureStarted)}
    files = [
        (entry.file.rsplit("/", 1)[-1], text_sha256(entry.text)) for entry in session.manifest.procedures
    ]
    titles = Table(
        name="procedures",
        title="Procedure files",
        columns=(Column(key="file", name="file"), Column(key="sha256", name="sha256")),
        rows=tuple(files),
    )
    outcomes = {(one.procedure, one.index): one.outcome for one in session.events(ev.StepFinished)}
    rows = dict[tuple[str, int], tuple[Cell, ...]]()
    for step in session.events(ev.StepStarted):
        at = step.procedure, step.index
        rows[at] = (*at, step.title, step.shots or None, outcomes.get(at, session.unfinished_text))
    steps = Table(
        name="steps",
        title="Steps",
        columns=(
            Column(key="procedure", name="procedure"),
            Column(key="index", name="step"),
            Column(key="title", name="work"),
            Column(key="captures", name="captures"),
            Column(key="outcome", name="outcome"),
        ),
        rows=tuple(rows.values()),
    )
    facts = tuple(Fact(name, title) for name, title in started.items())
    return Section("procedure", "Procedure", facts, (NO_CLAIM,), tuple(t for t in (titles, steps) if t.rows))


def decision_section(session: SessionRecord, calibration: Calibration | None) -> Section:
    """Every limit that was checked, with its verdict, and the decision rule."""
    table = Table(
        name="decisions",
        title="Limits and decisions",
        columns=(
            Column(key="step", name="step"),
            Column(key="of", name="of"),
            Column(key="quantity", name="quantity"),
            Column(key="value", name="value", format=".4g"),
            Column(key="limit", name="limit"),
            Column(key="verdict", name="verdict"),
        ),
        rows=tuple((*row[:-1], row[-1] or NOT_EVALUATED) for row in limit_rows(session, calibration)),
    )
    fit = session.fit
    texts = [DECISION_RULE, *(f"Refused: {reason}." for reason in (fit.reasons if fit else ()))]
    if not table.rows:
        texts.append("The procedures check no limit, and no calibration was verified.")
    return Section(
        "decisions", "Limits and decisions", texts=tuple(texts), tables=(table,) if table.rows else ()
    )


def exception_section(session: SessionRecord) -> Section:
    """Deviations: overruled warnings, rejected and repeated captures, repairs, missing readings."""
    tables = (
        _overruled(session),
        _rejected(session),
        _repeated(session),
        _missing(session),
        _incidents(session),
    )
    shown = tuple(table for table in tables if table.rows)
    texts = () if shown else ("No capture was rejected or repeated; nothing deviated from the procedures.",)
    return Section("exceptions", "Deviations, rejected and repeated captures", texts=texts, tables=shown)


def _overruled(session: SessionRecord) -> Table:
    return _table(
        "overruled",
        "Warnings that the operator overruled",
        (
            Column(key="time", name="time (UTC)"),
            Column(key="warning", name="warning"),
            Column(key="reason", name="reason"),
            Column(key="by", name="overruled by"),
            Column(key="state", name="state"),
        ),
        (
            (
                f"{one.time:%Y-%m-%d %H:%M:%S}",
                one.text,
                one.reason or NOT_STATED,
                one.by,
                "in effect" if one.in_effect else "results replaced since",
            )
            for one in session.overruled
        ),
    )


def _rejected(session: SessionRecord) -> Table:
    rejected = session.fit.rejected if session.fit else ()
    reasons = Counter(("fit", one.reason) for one in rejected)
    reasons.update(("spots", failure) for one in session.events(ev.SpotsFound) for failure in one.failures)
    return _table(
        "rejected",
        "Captures and spots that were not used",
        (
            Column(key="by", name="rejected by"),
            Column(key="reason", name="reason"),
            Column(key="count", name="number"),
        ),
        ((*key, count) for key, count in reasons.items()),
    )


def _repeated(session: SessionRecord) -> Table:
    rows: list[tuple[str, str, str]] = []
    rows += [(when, "placement", one.text) for when, one in session.timed(ev.SetAside)]
    rows += [
        (when, "repair", f"{one.text} ({one.operator})") for when, one in session.timed(ev.SessionRepaired)
    ]
    rows += [(when, "resumed", _resumed(one)) for when, one in session.timed(ev.SessionResumed)]
    return _table(
        "repeated",
        "Placements captured again or left out, resumptions and repairs",
        (
            Column(key="time", name="time (UTC)"),
            Column(key="kind", name="kind"),
            Column(key="text", name="what and why"),
        ),
        sorted(rows),
    )


def _missing(session: SessionRecord) -> Table:
    causes = Counter(
        (one.trial, one.reference_mm, one.cause) for one in session.events(ev.ReadingTaken) if one.cause
    )
    return _table(
        "missing_readings",
        "Readings without a range",
        (
            Column(key="trial", name="trial"),
            Column(key="true_mm", name="true range", unit="mm", format="g"),
            Column(key="cause", name="cause"),
            Column(key="count", name="number"),
        ),
        ((*key, count) for key, count in causes.items()),
    )


def _incidents(session: SessionRecord) -> Table:
    return _table(
        "incidents",
        "Incidents",
        (
            Column(key="time", name="time (UTC)"),
            Column(key="of", name="of"),
            Column(key="message", name="message"),
        ),
        ((when, one.of, one.message) for when, one in session.timed(ev.Incident)),
    )


def _resumed(one: ev.SessionResumed) -> str:
    changes = f"; changed: {', '.join(one.changes)}" if one.changes else ""
    reason = f"; accepted because: {one.accepted_because}" if one.accepted_because else ""
    return f"resumed by {one.operator}{changes}{reason}"


def _table(name: str, title: str, columns: tuple[Column, ...], rows: Iterable[tuple[Cell, ...]]) -> Table:
    return Table(name=name, title=title, columns=columns, rows=tuple(rows))
