"""`workbench use`: put a calibration in force for a sensor, also an earlier one (roll back)."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path

from workbench.cli.console import print_message
from workbench.cli.option_types import REASON_PLACEHOLDER
from workbench.cli.sessions import find_session
from workbench.model.calibration import Calibration, load_calibration
from workbench.model.contents import file_sha256
from workbench.model.errors import BadInputError, LimitFailedError
from workbench.model.event import CalibrationLoaded
from workbench.report.certificate.session_record import SessionRecord, check_recorded, read_session
from workbench.report.history.calibrations import range_changes
from workbench.report.history.in_force import dated_calibrations, in_force, newer_text, sensor_in_force
from workbench.session.caller import now, operator
from workbench.session.index import indexed_sessions, read_indexed
from workbench.session.manifest import MANIFEST
from workbench.session.sensor_log import SensorEntry, append_entry, read_entries


@dataclass(frozen=True)
class Choice:
    """Reason and person of the choice."""

    reason: str
    operator: str | None = None
    """None: the account."""


def put_in_force(name: Path, serial: str, choice: Choice, sessions: Path) -> None:
    """Record a calibration as the one in force, and print the change of ranges against the one before.

    Raises:
        BadInputError: there is no such calibration, it is of another sensor, or the record cannot be written.
        LimitFailedError: the calibration, or that of the session, is refused.
    """
    path = _file(name, sessions)
    calibration = load_calibration(path)
    _check(path, calibration, serial)
    before = _before(sessions, serial)
    inside = path.resolve().is_relative_to(sessions.resolve())
    entry = SensorEntry(
        serial=serial,
        kind="in_force",
        time=now(),
        operator=operator(choice.operator),
        text=choice.reason,
        path=str(path.resolve().relative_to(sessions.resolve()) if inside else path.resolve()),
        sha256=file_sha256(path),
    )
    append_entry(sessions, entry)
    print_message(f"{serial}: {entry.path} is in force since {entry.time[:10]}: {entry.text}")
    if newer := _newer_text(sessions, serial):
        print_message(f"note: {newer}")
    if before is None:
        print_message("no calibration was in force before")
        return
    for change in range_changes(before, calibration):
        print_message(
            f"  at {change.range_mm:g} mm: {round(change.change_mm, 2) + 0.0:+.2f} mm against the one before"
            f" (sd {change.sd_mm:.2g} mm)"
        )


def _before(sessions: Path, serial: str) -> Calibration | None:
    """The calibration in force until now; None if there is none, or its file has changed."""
    try:
        found = sensor_in_force(sessions, serial)
    except BadInputError as error:
        print_message(f"note: {error}")
        return None
    return None if found is None else found.calibration.calibration


def _newer_text(sessions: Path, serial: str) -> str:
    """Remark on a newer accepted calibration than the one now in force; empty if there is none."""
    own = [one for one in indexed_sessions(sessions) if one.serial == serial]
    calibrations = dated_calibrations(own)[0]
    return newer_text(in_force(sessions, calibrations, read_entries(sessions, serial)), calibrations)


def _file(name: Path, sessions: Path) -> Path:
    """Calibration file: as named, or that of a session.

    Raises:
        BadInputError: there is none, it is not that of the session any more, or it is the copy of another.
        LimitFailedError: the last fit of the session is refused.
    """
    if name.is_file():
        try:
            check_recorded(name)
        except BadInputError:
            _check_session(name.parent)
            raise
        if (name.resolve().parent / MANIFEST).is_file():
            _refuse_copy(read_session(name.resolve().parent), name.resolve().name, sessions)
        return name
    folder = find_session(name, sessions)
    _check_session(folder)
    session = read_session(folder)
    path = session.calibration_path
    if path is None:
        raise BadInputError(f"{name}: expected a calibration, the session has none")
    _refuse_copy(session, path.name, sessions)
    return path


def _refuse_copy(session: SessionRecord, name: str, sessions: Path) -> None:
    """Refuse the copy of an existing calibration that a session used: its session is another one.

    Raises:
        BadInputError: the file `name` of the session is such a copy.
    """
    used = [one for one in session.events(CalibrationLoaded) if one.path == name]
    if not used or session.is_own_calibration:
        return
    options = ["--rig", session.rig.serial, "--reason", REASON_PLACEHOLDER, "--sessions", str(sessions)]
    command = shlex.join(["workbench", "use", used[-1].file, *options])
    raise BadInputError(
        f"{session.folder}: expected a session that made a calibration, got one that used that of"
        f" {used[-1].file}; put that one in force: {command}"
    )


def _check_session(folder: Path) -> None:
    """Raise if the last fit of a session is refused."""
    if read_indexed(folder).verdict == "refused":
        fit = read_session(folder).fit
        reasons = "" if fit is None else "; ".join(fit.reasons)
        raise LimitFailedError(f"{folder}: the calibration of this session is refused: {reasons}")


def _check(path: Path, calibration: Calibration, serial: str) -> None:
    own = calibration.laser_ranger.provenance.serial
    if own != serial:
        raise BadInputError(f"{path}: expected a calibration of the sensor {serial}, got one of {own}")
    fit = calibration.laser_ranger.fit
    if not fit.usable:
        raise LimitFailedError(f"{path}: the calibration is refused: {'; '.join(fit.reasons)}")
