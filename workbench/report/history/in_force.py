"""Calibration in force of a sensor: the newest accepted one, until `workbench use` chooses one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from math import inf
from pathlib import Path

from workbench.model.calibration import Calibration, load_calibration
from workbench.model.contents import file_sha256
from workbench.model.errors import BadInputError
from workbench.report.certificate.session_record import unchanged
from workbench.session.index import IndexedSession, indexed_sessions
from workbench.session.sensor_log import SensorEntry, read_entries


@dataclass(frozen=True)
class DatedCalibration:
    """A calibration that a session exported."""

    session: str
    day: str
    path: Path
    sha256: str
    calibration: Calibration


@dataclass(frozen=True)
class InForce:
    """The calibration in force."""

    calibration: DatedCalibration
    since: str
    why: str
    by: str
    """Operator who put it in force; empty: the newest one is in force."""


def dated_calibrations(sessions: Sequence[IndexedSession]) -> tuple[list[DatedCalibration], list[str]]:
    """Usable calibrations of the sessions, in order of time, and remarks on the files of others."""
    found, remarks = [], []
    for one in sorted(sessions, key=lambda each: (each.began, each.name)):
        if not one.calibration or one.verdict not in {"accepted", "exception"}:
            continue
        path = one.status.session_dir / one.calibration
        try:
            found.append(dated(unchanged(path, one.calibration_sha256), one.name, one.began[:10]))
        except BadInputError as error:
            remarks.append(str(error))
    return found, remarks


def dated(path: Path, session: str, day: str) -> DatedCalibration:
    """Read a calibration.

    Raises:
        BadInputError: the file is missing or wrong.
    """
    calibration = load_calibration(path)
    return DatedCalibration(session, day, path, file_sha256(path), calibration)


def in_force(
    folder: Path, calibrations: Sequence[DatedCalibration], entries: Sequence[SensorEntry]
) -> InForce | None:
    """The calibration that was put in force last, else the newest one; None if there is none.

    Raises:
        BadInputError: the file that was put in force is missing, or has changed since.
    """
    chosen = [one for one in entries if one.kind == "in_force"]
    if chosen:
        return _chosen(folder, chosen[-1])
    if not calibrations:
        return None
    newest = calibrations[-1]
    return InForce(newest, newest.day, "the newest accepted calibration", "")


def sensor_in_force(folder: Path, serial: str) -> InForce | None:
    """The calibration in force for a sensor, by a folder of sessions; None if there is none.

    Raises:
        BadInputError: as of `in_force`.
    """
    entries = read_entries(folder, serial)
    if any(one.kind == "in_force" for one in entries):
        return in_force(folder, (), entries)
    own = [one for one in indexed_sessions(folder) if one.serial == serial]
    return in_force(folder, dated_calibrations(own)[0], ())


def newer_text(force: InForce | None, calibrations: Sequence[DatedCalibration]) -> str:
    """Remark that a newer accepted calibration exists than the one in force; empty if there is none."""
    if force is None:
        return ""
    ours = force.calibration
    newer = [one for one in calibrations if one.sha256 != ours.sha256 and _made_s(one) > _made_s(ours)]
    if not newer:
        return ""
    return (
        f"a newer accepted calibration exists: {newer[-1].session}, {newer[-1].day}; in force is that of"
        f" {ours.session}, {ours.day} (`workbench use` chooses)"
    )


def _made_s(one: DatedCalibration) -> float:
    """Time of making a calibration, s since 1970; negative infinity if the file states none."""
    try:
        return datetime.fromisoformat(one.calibration.laser_ranger.provenance.created).timestamp()
    except ValueError:
        return -inf


def _chosen(folder: Path, last: SensorEntry) -> InForce:
    path = folder / last.path
    found = dated(path, path.parent.name, "")
    if found.sha256 != last.sha256:
        raise BadInputError(
            f"{path}: expected the calibration put in force on {last.time[:10]} (sha256"
            f" {last.sha256[:12]}), the file has changed; restore it, or put another one in force with"
            " `workbench use`"
        )
    made = found.calibration.laser_ranger.provenance.created[:10]
    calibration = DatedCalibration(found.session, made, path, found.sha256, found.calibration)
    return InForce(calibration, last.time[:10], last.text, last.operator)
