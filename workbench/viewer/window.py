"""The viewer's window, for `workbench view`."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

from workbench.model.errors import BadInputError

LOOPBACK = "127.0.0.1"


def viewer_executable() -> Path:
    """The viewer itself. The console script `rerun` is a parent process that leaves it behind when stopped.

    Raises:
        BadInputError: it is not installed.
    """
    spec = find_spec("rerun_cli")
    if spec is None or spec.origin is None:
        raise BadInputError("the Rerun viewer is not installed; install rerun-sdk at the locked version")
    for name in ("rerun", "rerun.exe"):
        path = Path(spec.origin).with_name(name)
        if path.exists():
            return path
    raise BadInputError(f"{spec.origin}: expected the Rerun viewer beside this file; install rerun-sdk anew")


def viewer_environment() -> dict[str, str]:
    """Environment for the viewer's executable. `CI` is what keeps it from reporting its use to its makers."""
    return {**os.environ, "CI": "1"}


def open_viewer(recording: Path) -> int:
    """Show a recording in the viewer until the window is closed; the viewer's exit code.

    The viewer always listens on a port: here on loopback only, and on one that the system chooses, so that
    two sessions can be looked at side by side.

    Raises:
        BadInputError: there is no such recording, or no viewer.
    """
    if not recording.is_file():
        raise BadInputError(f"{recording}: no such recording; expected a session's recording.rrd")
    if sys.platform == "linux" and not {"DISPLAY", "WAYLAND_DISPLAY"} & set(os.environ):
        raise BadInputError(f"no display here to show {recording} on; copy it to a machine that has one")
    command = [str(viewer_executable()), "--bind", LOOPBACK, "--port", "0", str(recording)]
    # The executable comes from our own dependency, the path is a file that exists.
    return subprocess.run(command, env=viewer_environment(), check=False).returncode  # noqa: S603
