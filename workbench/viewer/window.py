"""Viewer window for `workbench view`."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import quote

from workbench.model.errors import BadInputError

LOOPBACK = "127.0.0.1"
END = bytes(16) + b"recording closed"
"""End of a recording without a footer: Rerun's last message, of kind and length 0, and a text that readers do
not reach. Zeros alone may be left by a power failure."""
FOOTER = b"RRF2FOOT"
"""Mark at the end of a complete recording."""
TAIL_BYTES = 64
HEAD = b"RRF"
"""First bytes of a recording of any release of Rerun."""


def viewer_executable() -> Path:
    """Executable of the viewer itself; the console script `rerun` leaves it running when stopped.

    Raises:
        BadInputError: the viewer is not installed.
    """
    spec = find_spec("rerun_cli")
    if spec is None or spec.origin is None:
        raise BadInputError("the Rerun viewer is not installed; install rerun-sdk at the locked version")
    for name in ("rerun", "rerun.exe"):
        path = Path(spec.origin).with_name(name)
        if path.exists():
            return path
    raise BadInputError(
        f"{spec.origin}: expected the Rerun viewer beside this file, got none; reinstall rerun-sdk"
    )


def viewer_environment() -> dict[str, str]:
    """Environment for the viewer's executable; `CI` disables its usage reports."""
    return {**os.environ, "CI": "1"}


def has_display() -> bool:
    """Whether a window can be opened."""
    return sys.platform != "linux" or bool({"DISPLAY", "WAYLAND_DISPLAY"} & set(os.environ))


def free_port() -> int:
    """Port on loopback that no program listens on."""
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        return int(probe.getsockname()[1])


def watch(port: int) -> None:
    """Open a viewer that watches a recording served at a port, without waiting for it.

    The window stays open when the session ends; it then shows the whole recording.

    Raises:
        BadInputError: the viewer is not installed.
    """
    command = [str(viewer_executable()), "--bind", LOOPBACK, "--port", "0"]
    command += ["--connect", f"rerun+http://{LOOPBACK}:{port}/proxy"]
    subprocess.Popen(  # noqa: S603  # the executable comes from our own dependency
        command,
        env=viewer_environment(),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,  # Ctrl-C at the terminal ends the session, not the window
    )


def is_complete(recording: Path) -> bool:
    """Whether a recording exists and has its end or its footer; one that was interrupted has neither."""
    try:
        with recording.open("rb") as file:
            file.seek(0, os.SEEK_END)
            file.seek(max(0, file.tell() - TAIL_BYTES))
            tail = file.read()
            return FOOTER in tail or tail.endswith(END)
    except OSError:
        return False


def serve(recording: Path, announce: Callable[[str], None]) -> int:
    """Serve a recording and the viewer to a browser on this computer until Ctrl-C; returns the exit code.

    Args:
        recording: file of the recording.
        announce: called with the address of the page before it is served.

    Raises:
        BadInputError: there is no such recording, or no viewer.
    """
    _check(recording)
    data, page = free_port(), free_port()
    command = [str(viewer_executable()), "--serve-web", "--bind", LOOPBACK]
    command += ["--port", str(data), "--web-viewer-port", str(page), str(recording)]
    source = quote(f"rerun+http://{LOOPBACK}:{data}/proxy", safe="")
    announce(f"http://{LOOPBACK}:{page}?url={source}")
    surroundings = {**viewer_environment(), "RUST_LOG": "warn"}  # not its own lines about the same address
    return subprocess.run(command, env=surroundings, check=False).returncode  # noqa: S603


def open_viewer(recording: Path) -> int:
    """Show a recording in the viewer until the window is closed; returns the viewer's exit code.

    The viewer always listens on a port: here on loopback only, on a port that the system chooses, so that
    several viewers can be open.

    Raises:
        BadInputError: there is no such recording, or no viewer.
    """
    _check(recording)
    if not has_display():
        raise BadInputError(
            f"{recording}: no display to show it; use --web, or copy the file to a computer with a display"
        )
    command = [str(viewer_executable()), "--bind", LOOPBACK, "--port", "0", str(recording)]
    # The executable comes from our own dependency, the path is a file that exists.
    return subprocess.run(command, env=viewer_environment(), check=False).returncode  # noqa: S603


def _check(recording: Path) -> None:
    if not recording.is_file():
        raise BadInputError(f"{recording}: no such recording; expected a file that ends in .rrd")
    with recording.open("rb") as file:
        if file.read(len(HEAD)) != HEAD:
            raise BadInputError(
                f"{recording}: expected a recording of Rerun; make that of a session by --rebuild"
            )
