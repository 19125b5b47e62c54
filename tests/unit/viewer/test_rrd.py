"""Recordings without an index in their footer: complete by the message at their end, and read as others."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.viewer.session import a_rig
from workbench.viewer.blueprint import blueprint
from workbench.viewer.rrd import open_rrd
from workbench.viewer.stream import Moment, Stream
from workbench.viewer.window import END, is_complete


def test_a_closed_recording_is_complete_and_read_to_its_end(tmp_path: Path) -> None:
    path = tmp_path / "r.rrd"
    stream = Stream(path, "s", blueprint(a_rig(), calibrates=False))
    for number in range(3):
        stream.at(Moment(number, 0, 1))
        stream.log_static_text(f"text/{number}", "hello")
    stream.flush()
    assert not is_complete(path)
    stream.close()
    assert is_complete(path)
    assert path.read_bytes().endswith(END)
    entities = {str(chunk.entity_path) for chunk in open_rrd(path).stream()}
    assert {f"/text/{number}" for number in range(3)} <= entities


def test_no_recording_is_refused(tmp_path: Path) -> None:
    (tmp_path / "r.rrd").write_bytes(b"no recording")
    with pytest.raises((OSError, RuntimeError)):
        list(open_rrd(tmp_path / "r.rrd").stream())


def test_zeros_of_a_power_failure_are_no_end(tmp_path: Path) -> None:
    (tmp_path / "r.rrd").write_bytes(b"RRF2" + bytes(200))
    assert not is_complete(tmp_path / "r.rrd")
