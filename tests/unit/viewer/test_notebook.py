"""Viewer in a notebook: the recording goes to the widget, and a missing package is named."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from rerun.chunk import RrdReader

import workbench as wb

ROOT = Path(__file__).parents[3]
SESSION = ROOT / "data/session-0.1.0"


class Widget:
    """Stand-in of `rerun_notebook.Viewer`, a package of 17 MB that the tests do not install."""

    def __init__(self, width: str, height: int, theme: str) -> None:
        self.shape = width, height, theme
        self.sent = b""

    def send_rrd(self, data: bytes) -> None:
        self.sent += data


def test_the_widget_gets_the_recording_of_the_session(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "rerun_notebook", SimpleNamespace(Viewer=Widget))
    widget: Any = wb.open_session(SESSION).viewer(height_px=500)
    assert widget.shape == ("auto", 500, "dark")
    (tmp_path / "sent.rrd").write_bytes(widget.sent)
    recordings = RrdReader(tmp_path / "sent.rrd").recordings()
    assert [one.application_id for one in recordings]
    assert not (SESSION / "recording.rrd").exists()


def test_a_missing_package_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rerun_notebook", None)
    with pytest.raises(wb.BadInputError):
        wb.open_session(SESSION).viewer()


def test_the_extra_has_the_version_of_rerun() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    (ours,) = (one for one in project["dependencies"] if one.startswith("rerun-sdk=="))
    assert ours.replace("sdk", "notebook") in project["optional-dependencies"]["notebooks"]
