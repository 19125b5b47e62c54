"""`workbench view`."""

from __future__ import annotations

from pathlib import Path

from workbench.viewer.window import open_viewer


def view_session(session: Path) -> int:
    """Show the session's recording until the window is closed; the viewer's exit code.

    Raises:
        BadInputError: there is no recording.
    """
    return open_viewer(session / "recording.rrd")
