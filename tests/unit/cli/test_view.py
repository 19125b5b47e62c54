"""`workbench view`."""

from __future__ import annotations

from pathlib import Path

from tests.support.command_line import Run, refused


def test_a_folder_without_a_session_is_refused(workbench: Run, tmp_path: Path) -> None:
    refused(workbench("view", tmp_path), 2, tmp_path, "session.yaml")
    assert list(tmp_path.iterdir()) == []
