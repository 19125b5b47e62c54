"""`workbench history`: calibrations and verifications of a sensor, control charts, notes."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from workbench.cli.console import print_message
from workbench.cli.report import Outputs
from workbench.model.contents import printable
from workbench.model.errors import BadInputError
from workbench.model.laboratory import load_laboratory
from workbench.report.document import Document
from workbench.report.document_files import write_document
from workbench.report.history.dates import future_text
from workbench.report.history.drift import distance_histories
from workbench.report.history.in_force import dated_calibrations, in_force, newer_text
from workbench.report.history.page import SensorHistory, history_document, of_one_calibration
from workbench.report.history.verifications import verifications
from workbench.report.terminal_table import TerminalTable
from workbench.session.caller import now, operator
from workbench.session.index import IndexedSession, copies_text, indexed_sessions
from workbench.session.sensor_log import SensorEntry, append_entry, read_entries


@dataclass(frozen=True)
class HistoryRequest:
    """Arguments of the command."""

    serial: str | None
    """None: the only sensor of the folder."""
    html: Path | None
    pdf: Path | None
    note: str | None
    """Note to add; None: none."""
    operator: str | None
    """Author of the note; None: the account."""
    sessions: Path


def show_history(request: HistoryRequest, as_json: bool) -> None:
    """Print the history of a sensor, write its page, and add a note.

    Raises:
        BadInputError: there is no such sensor, a file is damaged, or one cannot be written.
    """
    outputs = Outputs(request.html, request.pdf)
    outputs.check()
    every = indexed_sessions(request.sessions)
    serial = request.serial or only_serial(every, request.sessions)
    if request.note is not None:
        entry = SensorEntry(
            serial=serial, kind="note", time=now(), operator=operator(request.operator), text=request.note
        )
        append_entry(request.sessions, entry)
    document = history_document(sensor_history(request.sessions, serial, every))
    write_document(document, outputs.html, outputs.pdf)
    if as_json:
        print(json.dumps({"serial": serial} | document.as_json()))
    else:
        _print(document)
    for path in outputs.files:
        print_message(f"{path} written")


def sensor_history(folder: Path, serial: str, every: Sequence[IndexedSession]) -> SensorHistory:
    """History of a sensor.

    Args:
        folder: folder of sessions.
        serial: serial number of the sensor.
        every: sessions of the folder.

    Raises:
        BadInputError: there is neither a session nor an entry of the sensor, or a file is damaged.
    """
    own = [one for one in every if one.serial == serial]
    entries = read_entries(folder, serial)
    if not own and not entries:
        known = ", ".join(sorted({one.serial for one in every if one.serial})) or "none"
        raise BadInputError(
            f"{folder}: expected sessions of the sensor {serial}; sensors with sessions: {known}"
        )
    calibrations, remarks = dated_calibrations(own)
    force = in_force(folder, calibrations, entries)
    checked = of_one_calibration(verifications(folder, own), force)
    laboratory = load_laboratory(folder)
    agreed = None if laboratory is None else laboratory.recalibration
    return SensorHistory(
        serial,
        calibrations,
        force,
        checked,
        distance_histories(checked),
        entries,
        None if agreed is None else agreed.months,
        tuple(filter(None, (newer_text(force, calibrations), *remarks, *_remarks_on(every, own)))),
    )


def _remarks_on(every: Sequence[IndexedSession], own: Sequence[IndexedSession]) -> tuple[str, ...]:
    """Remarks on copies of the sensor's sessions, on dates, and on damaged sessions of this or no sensor."""
    damaged = [one for one in every if one.status.state == "damaged" and (one in own or not one.serial)]
    return copies_text(own), future_text(own), *(f"not counted: {one.status.why}" for one in damaged)


def only_serial(every: Sequence[IndexedSession], folder: Path) -> str:
    """Serial number of the only sensor with sessions.

    Raises:
        BadInputError: there is none, or several.
    """
    counts = Counter(one.serial for one in every if one.serial)
    if len(counts) != 1:
        got = (
            ", ".join(f"{serial} ({count} sessions)" for serial, count in sorted(counts.items()))
            or "no session"
        )
        raise BadInputError(f"{folder}: expected --rig SERIAL, because the sessions are of: {got}")
    return next(iter(counts))


def _print(document: Document) -> None:
    console = Console(markup=False, highlight=False)
    console.print(printable(document.verdict.text))
    for line in (*document.verdict.reasons, *(f"{fact.name}: {fact.value}" for fact in document.head)):
        console.print(f"  {printable(line)}", soft_wrap=True)
    for section in document.sections:
        for table in section.tables:
            console.print(TerminalTable(table))
