"""History of a sensor as a document: verdict, control charts, calibrations, notes."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import date

from workbench.model.number_text import counted
from workbench.model.table import Column, Table
from workbench.report.certificate.recalibration import months_later
from workbench.report.document import Document, Fact, KeyNumber, Section, Tone, Verdict
from workbench.report.history.calibration_section import calibration_section
from workbench.report.history.drift import DistanceHistory
from workbench.report.history.in_force import DatedCalibration, InForce
from workbench.report.history.verification_section import verification_section
from workbench.report.history.verifications import Verification, unmonitored_texts
from workbench.session.sensor_log import SensorEntry
from workbench.trials.statistics.control_chart import FIRST_SESSIONS


@dataclass(frozen=True)
class SensorHistory:
    """Everything that is known about one sensor."""

    serial: str
    calibrations: Sequence[DatedCalibration]
    in_force: InForce | None
    verifications: Sequence[Verification]
    """Those of `of_one_calibration`, in order of time."""
    distances: Sequence[DistanceHistory]
    entries: Sequence[SensorEntry]
    agreed_months: int | None
    """Agreed interval of recalibration; None: none."""
    remarks: Sequence[str] = ()

    @property
    def verified(self) -> str:
        """Calibration that the verifications used, in words."""
        return "the calibration in force" if self.in_force else "the calibration of the last one"


def of_one_calibration(checked: Sequence[Verification], force: InForce | None) -> tuple[Verification, ...]:
    """Verifications with the calibration in force; if there is none, those with that of the last one."""
    if not checked:
        return ()
    sha256 = checked[-1].calibration if force is None else force.calibration.sha256
    return tuple(one for one in checked if one.calibration == sha256)


def history_document(history: SensorHistory) -> Document:
    """The document."""
    force = history.in_force
    since = "none" if force is None else f"{force.calibration.session}, since {force.since}: {force.why}"
    count = len(history.verifications)
    head = (
        Fact("Serial number", history.serial),
        Fact("Calibration in force", since),
        Fact("Verifications with it", str(count if force is not None else 0)),
        *((Fact(f"Verifications with {history.verified}", str(count)),) if force is None else ()),
    )
    sections = (
        verification_section(history.verifications, history.distances),
        calibration_section(history.calibrations),
        _note_section(history),
    )
    verdict = verdict_of(history)
    return Document("History of a sensor", "", "", head, verdict, _key_numbers(history), sections)


def verdict_of(history: SensorHistory) -> Verdict:
    """In control, drifted, wrong, or not known yet; with the date of the next calibration and its rule."""
    reasons = [text for one in history.distances for text in (_drift_text(one), _excess_text(one)) if text]
    if _last_is_not_valid(history):
        reasons.append(f"the last verification, {history.verifications[-1].session}, ended with: not valid")
    if history.in_force is not None and history.in_force.remark:
        reasons.append(f"{history.in_force.calibration.session}: {history.in_force.remark}")
    reasons += _due_texts(history)
    reasons += [*_missing_texts(history), *history.remarks]
    return Verdict(*_tone_and_text(history), tuple(reasons))


def _tone_and_text(history: SensorHistory) -> tuple[Tone, str]:
    if any(one.drift for one in history.distances):
        return "bad", "Drifted: calibrate again"
    if any(one.excess is not None and one.excess.alarm for one in history.distances):
        return "bad", "Errors beyond their stated uncertainty: calibrate again"
    if _last_is_not_valid(history):
        return "bad", "The last verification ended with: not valid; calibrate again"
    if history.in_force is not None and history.in_force.refused:
        return (
            "bad",
            "The calibration in force is of a session that was refused since; put another one in force",
        )
    charts = [one for one in history.distances if one.chart is not None]
    tested = {name for one in charts for name in one.sessions[FIRST_SESSIONS:]}
    if tested:
        text = f"In control over {counted(len(tested), 'session')}"
        if any(one.excess for one in history.distances):
            return "open", f"{text}, but the last error exceeds U"
        if history.in_force is None:
            return "open", f"{text}, but no calibration is in force"
        return "good", text
    count = len(history.verifications)
    if history.in_force is None and not count:
        return "open", "No calibration is in force, and there is no verification"
    text = f"No control limits yet: {count} of {FIRST_SESSIONS} verifications with {history.verified}"
    if charts:
        text = f"Control limits from {FIRST_SESSIONS} verifications; none after them yet"
    elif count >= FIRST_SESSIONS:
        text = "No control limits: the verifications have no distance in common, or equal readings"
    return "open", text


def _last_is_not_valid(history: SensorHistory) -> bool:
    return bool(history.verifications) and not history.verifications[-1].valid


def recalibrate_by(history: SensorHistory) -> tuple[date, str] | None:
    """Earliest date of the next calibration, and its rule; None: no rule gives one."""
    dates = []
    force = history.in_force
    if force is not None and history.agreed_months is not None:
        months = history.agreed_months
        with suppress(ValueError):  # a calibration that another program wrote
            made = date.fromisoformat(force.calibration.day)
            dates.append((months_later(made, months), f"agreed interval of {months} months"))
    for one in history.distances:
        if one.drift is not None or (one.excess is not None and one.excess.alarm):
            dates.append((_last_day(history), f"alarm at {one.range_mm:g} mm: at once"))
        elif one.due is not None:
            dates.append((one.due, f"the trend at {one.range_mm:g} mm reaches a control limit"))
    if _last_is_not_valid(history):
        dates.append((_last_day(history), "the last verification is not valid: at once"))
    return min(dates, default=None)


def _last_day(history: SensorHistory) -> date:
    return date.fromisoformat(history.verifications[-1].day)


def _due_texts(history: SensorHistory) -> list[str]:
    due = recalibrate_by(history)
    return [] if due is None else [f"recalibrate by {due[0]}: {due[1]}"]


def _drift_text(one: DistanceHistory) -> str:
    drift = one.drift
    if drift is None:
        return ""
    if drift.rule == "scatter of the repeats":
        return f"the scatter of the repeats at {one.range_mm:g} mm is above its limit since {drift.since}"
    amount = f"{100 * drift.amount:+.2g} %"
    return f"drifted by {amount} at {one.range_mm:g} mm since {drift.since} ({drift.rule})"


def _excess_text(one: DistanceHistory) -> str:
    excess = one.excess
    if excess is None:
        return ""
    amounts = f"{100 * excess.error:+.2g} %, U = {100 * excess.expanded:.2g} %"
    return f"the error at {one.range_mm:g} mm exceeds its stated uncertainty on {excess.day}: {amounts}"


def _missing_texts(history: SensorHistory) -> list[str]:
    """Monitored distances that sessions lack, and distances that are not monitored."""
    checked = history.verifications
    texts = []
    for one in history.distances:
        lacking = [each.session for each in checked if each.checks and each.session not in one.sessions]
        if lacking:
            where = counted(len(lacking), "session")
            texts.append(f"{one.range_mm:g} mm is monitored, but missing in {where}, last in {lacking[-1]}")
    return texts + unmonitored_texts(checked, [one.range_mm for one in history.distances])


def _key_numbers(history: SensorHistory) -> tuple[KeyNumber, ...]:
    due = recalibrate_by(history)
    numbers = [
        KeyNumber("Calibrations", str(len(history.calibrations)), "accepted, in this folder"),
        KeyNumber("Verifications", str(len(history.verifications)), f"with {history.verified}"),
        KeyNumber(
            "Recalibrate by", "-" if due is None else str(due[0]), "no rule" if due is None else due[1]
        ),
    ]
    if history.distances:
        worst = max(history.distances, key=lambda one: abs(float(one.errors[-1])))
        latest = f"{100 * float(worst.errors[-1]):+.2g} %"
        note = f"mean error of the last session at {worst.range_mm:g} mm, of the range"
        numbers.append(KeyNumber("Largest latest error", latest, note))
    return tuple(numbers)


def _note_section(history: SensorHistory) -> Section:
    table = Table(
        name="notes",
        title="Notes, and calibrations put in force",
        columns=(
            Column(key="time", name="time"),
            Column(key="operator", name="operator"),
            Column(key="kind", name="kind"),
            Column(key="text", name="text"),
            Column(key="path", name="calibration"),
        ),
        rows=tuple(
            (one.time, one.operator, one.kind.replace("_", " "), one.text, one.path)
            for one in history.entries
        ),
    )
    return Section(
        "notes", "Notes", tables=(table,) if table.rows else (), texts=() if table.rows else ("None.",)
    )
