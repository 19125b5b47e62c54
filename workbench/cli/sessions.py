"""`workbench sessions`, and the look-up of a session by name."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

from rich.console import Console
from rich.padding import Padding
from rich.text import Text

from workbench.cli.brief_notes import merge_equal_kinds
from workbench.cli.console import print_message
from workbench.cli.verdict import split_reason
from workbench.model import event as ev
from workbench.model.errors import BadInputError, LimitFailedError
from workbench.model.number_text import counted
from workbench.report.history.dates import future_text
from workbench.session.index import (
    IndexedSession,
    SessionSelection,
    copies_text,
    indexed_sessions,
    read_indexed,
)
from workbench.session.journal import read_journal
from workbench.session.manifest import MANIFEST
from workbench.session.state import SessionStatus, effective, session_statuses

SHOWN = 20
"""Number of latest sessions that are listed."""


def list_sessions(sessions: Path, as_json: bool, selection: SessionSelection = SessionSelection()) -> None:
    """Print the status of every session, and the commands that continue unfinished ones.

    Args:
        sessions: folder of sessions, or the folder of one session.
        as_json: whether to print JSON.
        selection: sessions to list.

    Raises:
        BadInputError: there is no such folder.
    """
    if (sessions / MANIFEST).is_file():
        folder = find_session(sessions, sessions)
        every = [read_indexed(folder)]
    else:
        every = indexed_sessions(sessions)
    found = [one for one in every if selection.includes(one)]
    for note in filter(None, (copies_text(found), future_text(found))):
        print_message(f"note: {note}")
    if as_json:
        for each in found:
            print(json.dumps(_as_json(each)))
        return
    console = Console(markup=False, highlight=False)
    if not found:
        which = "no sessions" if not every else f"none of {len(every)} sessions is selected"
        Console(stderr=True, markup=False).print(f"{which} in {sessions}")
        return
    for each in found[-SHOWN:]:
        _show(each.status, console)
    if len(found) > SHOWN:
        console.print(f"and {len(found) - SHOWN} older ones")


def _as_json(one: IndexedSession) -> dict[str, object]:
    fields = vars(one.status) | {"session_dir": str(one.status.session_dir)}
    return fields | {"serial": one.serial, "began": one.began, "verdict": one.verdict}


def find_session(name: Path | None, sessions: Path) -> Path:
    """Folder of a session.

    Args:
        name: path of the session, or its name in `sessions`; None: the last unfinished session.
        sessions: folder of sessions.

    Raises:
        BadInputError: there is no such session; or none is named, and one is running, which may be meant.
    """
    if name is not None:
        known = [path for path in (name, sessions / name) if (path / MANIFEST).is_file()]
        if known:  # `.` and `..` are resolved, because the folder's name is needed
            return known[0] if known[0].name not in {"", ".."} else known[0].resolve()
        raise BadInputError(f"{name}: expected a session folder, or the name of one in {sessions}")
    found = session_statuses(sessions)
    unfinished = [each for each in found if each.unfinished]
    if running := [each for each in found if each.state == "running"]:
        others = "".join(f"\n  {command}" for each in unfinished[-SHOWN:] if (command := next_command(each)))
        raise BadInputError(
            f"{running[-1].session_dir}: the session is running in another program;"
            f" others to resume or repair: {others or 'none'}"
        )
    if not unfinished:
        raise BadInputError(f"{sessions}: no unfinished session to resume")
    return unfinished[-1].session_dir


def _show(one: SessionStatus, console: Console) -> None:
    """Print a session: what it is, how it ended, and the command that continues it."""
    columns = [one.session_dir.name, one.rig, counted(one.captures, "capture"), one.state]
    console.print("  ".join(filter(None, columns)))
    accepted = one.calibration.startswith("accepted")
    lines = [one.calibration if accepted else "", *one.trials, "" if one.state == "finished" else _why(one)]
    for line in filter(None, lines):
        console.print(Padding(Text(line), (0, 0, 0, 4)))
    if (command := next_command(one)) is not None:
        console.print(f"    {command}", soft_wrap=True)


def _why(one: SessionStatus) -> str:
    """Cause of the end.

    Of a refused calibration each kind of reason once, with the remedy where no command contains it.
    """
    if not one.unfinished:
        return one.why
    from workbench.cli.refusal import refused_fit, repair_commands

    fit = refused_fit(one.session_dir)
    if fit is None:
        return one.why
    remedy = "" if repair_commands(one.session_dir, fit) else split_reason(fit.reasons[0])[1]
    causes = "; ".join(merge_equal_kinds(fit.reasons))
    return f"the calibration is refused: {causes}" + (f". Do: {remedy}" if remedy else "")


def next_command(one: SessionStatus) -> str | None:
    """Command that continues or repairs a session; None if there is none."""
    if not one.unfinished:
        return None
    # It loads scipy, and most sessions are finished.
    from workbench.cli.refusal import failed_limit_commands, refused_fit, repair_commands

    if (fit := refused_fit(one.session_dir)) is not None:
        commands = repair_commands(one.session_dir, fit)
    elif events := _ended_by_limit(one.session_dir):
        commands = failed_limit_commands(one.session_dir, events)
    else:
        commands = [["workbench", "resume", str(one.session_dir)]]
    return shlex.join(commands[0]) if commands else None


def _ended_by_limit(session_dir: Path) -> list[ev.Event]:
    """Valid events of a session that a failed limit ended; empty for others."""
    try:
        events = [record.event for record in effective(read_journal(session_dir))]
    except BadInputError:
        return []
    last = events[-1] if events else None
    ended = isinstance(last, ev.SessionFinished) and last.exit_code == LimitFailedError.exit_code
    return events if ended else []
