"""`workbench sessions`, and the look-up of a session by name."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from textwrap import shorten

from rich.console import Console
from rich.padding import Padding
from rich.text import Text

from workbench.model.errors import BadInputError
from workbench.session.manifest import MANIFEST
from workbench.session.state import SessionStatus, session_status, session_statuses

SHOWN = 20
"""Number of latest sessions that are listed."""
WHY_LINES = 2
"""Number of lines for the cause of an end; `--json` and the journal contain the full text."""
CUT_AT = 20
"""Allowance in characters for lines that are broken between words."""


def list_sessions(sessions: Path, as_json: bool) -> None:
    """Print the status of every session, and the command that resumes the last unfinished one.

    Args:
        sessions: folder of sessions, or the folder of one session.
        as_json: whether to print JSON.

    Raises:
        BadInputError: there is no such folder.
    """
    single = (sessions / MANIFEST).is_file()
    found = [session_status(find_session(sessions, sessions))] if single else session_statuses(sessions)
    if as_json:
        for each in found:
            print(json.dumps(asdict(each) | {"session_dir": str(each.session_dir)}))
        return
    console = Console(stderr=True, markup=False)
    if not found:
        console.print(f"no sessions in {sessions}")
        return
    _show(found[-SHOWN:], console)
    if len(found) > SHOWN:
        console.print(f"and {len(found) - SHOWN} older ones")
    if unfinished := [each for each in found if each.unfinished]:
        console.print(f"resume: workbench resume {unfinished[-1].session_dir}", soft_wrap=True)


def find_session(name: Path | None, sessions: Path) -> Path:
    """Folder of a session.

    Args:
        name: path of the session, or its name in `sessions`; None: the last unfinished session.
        sessions: folder of sessions.

    Raises:
        BadInputError: there is no such session.
    """
    if name is not None:
        known = [path for path in (name, sessions / name) if (path / MANIFEST).is_file()]
        if known:  # `.` and `..` are resolved, because the folder's name is needed
            return known[0] if known[0].name not in {"", ".."} else known[0].resolve()
        raise BadInputError(f"{name}: expected a session folder, or the name of one in {sessions}")
    found = session_statuses(sessions)
    unfinished = [each for each in found if each.unfinished]
    if not unfinished:
        if running := [each for each in found if each.state == "running"]:
            raise BadInputError(f"{running[-1].session_dir}: the session is running in another program")
        raise BadInputError(f"{sessions}: no unfinished session to resume")
    return unfinished[-1].session_dir


def _show(found: list[SessionStatus], console: Console) -> None:
    """Print one line per session, two for a long name, and the cause of the end of unfinished ones."""
    columns = [
        f"{each.state:{max(len(e.state) for e in found)}}  {each.captures:6} captures" for each in found
    ]
    room = console.width - max(map(len, columns)) - 2
    names = [each.session_dir.name for each in found]
    width = max((len(name) for name in names if len(name) <= room), default=0)
    for each, name, rest in zip(found, names, columns, strict=True):
        line = f"{name:{width}}  {rest}" if len(name) <= room else f"{name}\n    {rest}"
        console.print(line, highlight=False, soft_wrap=True)
        if each.state != "finished":
            why = shorten(each.why, WHY_LINES * (console.width - 4) - CUT_AT, placeholder=" ...")
            console.print(Padding(Text(why), (0, 0, 0, 4)))
