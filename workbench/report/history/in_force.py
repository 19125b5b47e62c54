"""Calibration in force of a sensor: the newest accepted one, until `workbench use` chooses one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from workbench.model.calibration import Calibration, load_calibration
from workbench.model.contents import file_sha256
from workbench.model.dates import is_future, parsed_time
from workbench.model.errors import BadInputError
from workbench.report.certificate.session_record import check_recorded, unchanged
from workbench.report.history.dates import EARLIEST, start_of, wrong_date
from workbench.session.index import IndexedSession, indexed_sessions, read_indexed
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
    remark: str = ""
    """A later result of its session, which a repair has changed; empty if there is none."""
    refused: bool = False
    """Whether that result is a refusal."""


def dated_calibrations(sessions: Sequence[IndexedSession]) -> tuple[list[DatedCalibration], list[str]]:
    """Usable calibrations of the sessions, in order of time, and remarks on those that are not.

    A session whose start is no time or after its first record is not used. One that begins in the future
    comes before the others, so that it is in force only if there is no other.
    """
    found, remarks = [], []
    for one in sorted(sessions, key=_order):
        if not one.calibration or one.verdict not in {"accepted", "exception"}:
            continue
        if wrong := wrong_date(one):
            remarks.append(f"not used: {wrong}")
            continue
        path = one.status.session_dir / one.calibration
        try:
            found.append(dated(unchanged(path, one.calibration_sha256), one.name, one.began[:10]))
        except BadInputError as error:
            remarks.append(str(error))
    return found, remarks


def _order(one: IndexedSession) -> tuple[bool, datetime, str]:
    start = start_of(one)
    return not is_future(start), start, one.name


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
    later = [one for one in calibrations if one.sha256 != ours.sha256 and _made(one) > _made(ours)]
    newer = [one for one in later if is_future(_made(ours)) or not is_future(_made(one))]
    if not newer:
        return ""
    return (
        f"a newer accepted calibration exists: {newer[-1].session}, {newer[-1].day}; in force is that of"
        f" {ours.session}, {ours.day} (`workbench use` chooses)"
    )


def _made(one: DatedCalibration) -> datetime:
    """Time of making a calibration; the earliest time there is if the file states none."""
    return parsed_time(one.calibration.laser_ranger.provenance.created) or EARLIEST


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
    remark, refused = _later_result(path)
    return InForce(calibration, last.time[:10], last.text, last.operator, remark, refused)


def _later_result(path: Path) -> tuple[str, bool]:
    """Remark on the result with which a repair replaced a calibration, and whether it is a refusal."""
    try:
        check_recorded(path)
    except BadInputError as error:
        refused = read_indexed(path.parent).verdict == "refused"
        result = "; its session is refused since" if refused else ""
        return f"in force in spite of a later result{result}: {error}", refused
    return "", False
