"""Starting the viewer for a person: on loopback, reporting to nobody, never on a file that is not there."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from workbench.model.errors import BadInputError
from workbench.viewer import window


def test_viewer_listens_on_loopback_only_and_reports_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    started: list[tuple[list[str], dict[str, str]]] = []

    def run(command: list[str], *, env: dict[str, str], **_: Any) -> subprocess.CompletedProcess[bytes]:
        started.append((command, env))
        return subprocess.CompletedProcess(command, 3)

    monkeypatch.setattr(subprocess, "run", run)
    monkeypatch.setenv("DISPLAY", ":0")
    recording = tmp_path / "recording.rrd"
    recording.write_bytes(b"RRF2")
    assert window.open_viewer(recording) == 3
    ((command, env),) = started
    assert Path(command[0]).name.startswith("rerun")
    assert command[1:5] == ["--bind", "127.0.0.1", "--port", "0"]
    assert command[-1] == str(recording)
    assert env["CI"] == "1"


def test_missing_recording_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"none\.rrd: no such recording"):
        window.open_viewer(tmp_path / "none.rrd")


@pytest.mark.parametrize("show", [window.open_viewer, lambda path: window.serve(path, lambda _: None)])
@pytest.mark.parametrize("content", [b"", b"RR", b"\x89PNG and more", bytes(100)])
def test_a_file_that_is_no_recording_is_refused(
    tmp_path: Path, show: Callable[[Path], int], content: bytes
) -> None:
    (tmp_path / "recording.rrd").write_bytes(content)
    with pytest.raises(BadInputError, match=r"recording\.rrd: expected a recording"):
        show(tmp_path / "recording.rrd")


def test_no_display_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    (tmp_path / "recording.rrd").write_bytes(b"RRF2")
    with pytest.raises(BadInputError, match="display"):
        window.open_viewer(tmp_path / "recording.rrd")


def test_missing_viewer_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(window, "find_spec", lambda _: None)
    with pytest.raises(BadInputError, match="viewer is not installed"):
        window.viewer_executable()
