"""Captures file of a session folder, and the remedy where the session has none."""

from __future__ import annotations

from pathlib import Path

from workbench.model.errors import BadInputError
from workbench.session.capture_table import CALIBRATION_TABLE
from workbench.session.manifest import MANIFEST, load_manifest
from workbench.session.state import session_status


def calibration_table(source: Path) -> Path:
    """The captures file itself, or that of a session's calibration.

    Raises:
        BadInputError: a session folder has no such file.
    """
    if not source.is_dir():
        return source
    table = source / CALIBRATION_TABLE
    if (source / MANIFEST).is_file() and not table.is_file():
        raise BadInputError(
            f"{source}: expected {CALIBRATION_TABLE}, got a session without it; {_remedy(source)}"
        )
    return table


def _remedy(session_dir: Path) -> str:
    """Source of captures to fit."""
    # Imported here: a fit of a captures file needs no procedures and no events.
    from workbench.model.event import CaptureTaken
    from workbench.procedure.engine.resume import plan_of
    from workbench.session.journal import read_journal

    status = session_status(session_dir)
    if status.state == "running":
        return "it is running in another program; wait for its fit step"
    procedures = plan_of(session_dir, load_manifest(session_dir)).procedures
    if status.unfinished and any(step.gives == "fit" for p in procedures for step in p.steps):
        return f"its fit step writes it: workbench resume {session_dir}"
    events = [record.event for record in read_journal(session_dir)] if status.captures else []
    if any(isinstance(event, CaptureTaken) and event.purpose == "calibration" for event in events):
        return (
            "its procedures have no fit step. In Python, with session = workbench.open_session(FOLDER):"
            " workbench.fit(session.captures_for_fit(), session.rig)"
        )
    return "it has no captures of a calibration; run a procedure with a fit step on its rig"
