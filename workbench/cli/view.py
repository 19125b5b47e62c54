"""`workbench view`."""

from __future__ import annotations

from pathlib import Path

from workbench.session.journal import read_journal
from workbench.session.manifest import load_session_rig
from workbench.session.state import effective
from workbench.viewer.window import open_viewer


def view_session(session: Path) -> int:
    """Show a session's recording until the window is closed; returns the viewer's exit code.

    A missing recording is made again from frames and journal.

    Raises:
        BadInputError: `session` is not a session folder, or a frame in it is damaged.
    """
    recording = session / "recording.rrd"
    if not recording.exists():
        from workbench.viewer.recording import rebuild

        rebuild(session, load_session_rig(session), effective(read_journal(session)), recording)
    return open_viewer(recording)
