"""Remark where a command uses another calibration than the one in force for its sensor."""

from __future__ import annotations

from pathlib import Path

from workbench.cli.console import print_message
from workbench.model.calibration import Calibration
from workbench.model.contents import file_sha256
from workbench.model.dates import future_remark
from workbench.model.errors import BadInputError
from workbench.model.rig import UNKNOWN_SERIAL
from workbench.session.manifest import MANIFEST

SESSIONS = Path("sessions")
"""Folder of sessions where no session is named: the default of all commands."""


def note_if_not_in_force(path: Path, calibration: Calibration, sessions: Path) -> None:
    """Print one line if another calibration of the sensor is in force by a folder of sessions.

    Another line is printed for a calibration that is dated in the future.

    Args:
        path: file of the calibration in use.
        calibration: its content.
        sessions: folder of sessions, which may be missing.
    """
    if remark := future_remark(str(path), calibration.laser_ranger.provenance.created):
        print_message(f"note: {remark}")
    serial = calibration.laser_ranger.provenance.serial
    if serial == UNKNOWN_SERIAL or not sessions.is_dir():
        return
    from workbench.report.certificate.session_record import check_recorded
    from workbench.report.history.in_force import sensor_in_force

    try:
        check_recorded(path)
        force = sensor_in_force(sessions, serial)
    except BadInputError as error:
        print_message(f"note: {error}")
        return
    if force is not None and force.remark:
        print_message(f"note: {force.remark}")
    if force is not None and force.calibration.sha256 != file_sha256(path):
        print_message(
            f"note: {path} is not the calibration in force for {serial}: since {force.since} it is"
            f" {force.calibration.path}, {force.why}"
        )


def sessions_of(*files: Path) -> Path:
    """Folder of sessions that contains the first of `files` that is in a session, or is one."""
    for path in files:
        for folder in (path.resolve(), path.resolve().parent):
            if (folder / MANIFEST).is_file():
                return folder.parent
    return SESSIONS
