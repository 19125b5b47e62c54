"""`workbench sessions`, and which session is meant by its name."""

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
from workbench.session.state import SessionStatus, session_statuses

SHOWN = 20
WHY_LINES = 2
"""For how a session ended; all of it is in `--json`, and in the session's journal."""
CUT_AT = 20
"""Lines are broken between words, this far before their end at most."""


def list_sessions(sessions: Path, as_json: bool) -> None:
    """Print where every session stands, and how to go on with the last unfinished one.

    Raises:
        BadInputError: there is no such folder.
    """
    found = session_statuses(sessions)
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
        console.print(f"go on: workbench resume {unfinished[-1].session_dir}", soft_wrap=True)


def find_session(name: Path | None, sessions: Path) -> Path:
    """The folder of the session `name`, a path or a name in `sessions`; without one the last unfinished.

    Raises:
        BadInputError: there is none.
    """
    if name is not None:
        known = [path for path in (name, sessions / name) if (path / MANIFEST).is_file()]
        if known:  # `.` is the folder that somebody stands in, and its name is told by its path alone
            return known[0] if known[0].name not in {"", ".."} else known[0].resolve()
        raise BadInputError(f"{name}: expected a session folder, or the name of one in {sessions}")
    found = session_statuses(sessions)
    unfinished = [each for each in found if each.unfinished]
    if not unfinished:
        if running := [each for each in found if each.state == "running"]:
            raise BadInputError(f"{running[-1].session_dir}: the session is running, in another program")
        raise BadInputError(f"{sessions}: no unfinished session to resume")
    return unfinished[-1].session_dir


def _show(found: list[SessionStatus], console: Console) -> None:
    """A line each, two where a name is too long; how it ended stands below, where it did not end well."""
    counted = [
        f"{each.state:{max(len(e.state) for e in found)}}  {each.captures:6} captures" for each in found
    ]
    room = console.width - max(map(len, counted)) - 2
    names = [each.session_dir.name for each in found]
    width = max((len(name) for name in names if len(name) <= room), default=0)
    for each, name, told in zip(found, names, counted, strict=True):
        line = f"{name:{width}}  {told}" if len(name) <= room else f"{name}\n    {told}"
        console.print(line, highlight=False, soft_wrap=True)
        if each.state != "finished":
            why = shorten(each.why, WHY_LINES * (console.width - 4) - CUT_AT, placeholder=" ...")
            console.print(Padding(Text(why), (0, 0, 0, 4)))
