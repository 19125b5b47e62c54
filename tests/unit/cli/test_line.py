"""A station at a real terminal: sensors one after another, counters, a failure, kills and stops."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from tests.crash.short import CALIBRATION, write_files
from tests.support.killed_session import wait_for_capture
from tests.support.terminal import at_terminal, plain_lines
from workbench.session.index import indexed_sessions

COMMAND = ("line", "p.yaml", "--rig", "rig.yaml", "--sessions", "s")


@pytest.fixture
def files(tmp_path: Path) -> Path:
    write_files(tmp_path, CALIBRATION)
    return tmp_path


def test_sensors_pass_and_fail_one_after_another(files: Path) -> None:
    with at_terminal(files, *COMMAND) as station:
        station.wait_for("0 sensors: 0 passed, 0 failed")
        station.type("SN 1")
        station.wait_for("SN 1: expected a serial number")
        station.type("SN-1")
        station.wait_for("1 sensor: 1 passed, 0 failed, yield 100.0 %")
        procedure = files / "p.yaml"
        procedure.write_text(CALIBRATION.replace("max_relative_range_sd: 0.5", "max_rms_px: 0.0001"))
        station.type("SN-2")
        station.wait_for("End the session here, with its calibration refused?")
        station.type("yes")
        station.wait_for("SN-2 FAILED: no certificate")
        station.wait_for("2 sensors: 1 passed, 1 failed, yield 50.0 %")
        station.type("")
        assert station.end() == 0
    lines = plain_lines(station.text)
    assert max(map(len, lines)) <= 80
    assert "line ended: 2 sensors: 1 passed, 1 failed, yield 50.0 %" in lines
    second_row, first_row = (line for line in lines[-12:] if line.startswith("SN-"))
    assert second_row.split()[:2] == ["SN-2", "FAILED"]
    assert "residual rms" in second_row
    assert first_row.split()[:2] == ["SN-1", "passed"]
    first, second = indexed_sessions(files / "s")
    assert (first.serial, second.serial) == ("SN-1", "SN-2")
    assert (first.status.session_dir / "certificate.html").is_file()
    assert not (second.status.session_dir / "certificate.html").exists()


def test_a_killed_session_is_continued_when_its_sensor_is_scanned(files: Path) -> None:
    with at_terminal(files, *COMMAND) as station:
        station.type("SN-1")
        wait_for_capture(files / "s", "short.1", station.process)
        station.process.kill()
    with at_terminal(files, *COMMAND) as station:
        station.wait_for("0 sensors: 0 passed, 0 failed; 1 unfinished")
        station.type("SN-1")
        station.wait_for("is continued")
        station.wait_for("1 sensor: 1 passed, 0 failed, yield 100.0 %")
        station.type("")
        assert station.end() == 0
    (one,) = indexed_sessions(files / "s")
    assert one.status.state == "finished"
    (one.status.session_dir / "certificate.html").unlink()  # as of a program killed before it
    with at_terminal(files, *COMMAND) as station:
        station.type("SN-1")
        station.wait_for("certificate.html")
        station.type("")
        assert station.end() == 0
    assert len(indexed_sessions(files / "s")) == 1
    assert (one.status.session_dir / "certificate.html").is_file()


def test_ctrl_c_ends_the_session_and_the_line(files: Path) -> None:
    with at_terminal(files, *COMMAND) as station:
        station.type("SN-1")
        wait_for_capture(files / "s", "short.1", station.process)
        os.kill(station.process.pid, signal.SIGINT)
        assert station.end() == 5
    lines = plain_lines(station.text)
    assert "stopped by Ctrl-C" in lines
    assert "0 sensors: 0 passed, 0 failed; 1 unfinished" in lines
    assert "Traceback" not in station.text


def test_ctrl_c_at_the_question_ends_the_line(files: Path) -> None:
    with at_terminal(files, *COMMAND) as station:
        station.wait_for("> ")
        os.kill(station.process.pid, signal.SIGINT)
        assert station.end() == 5
    assert "stopped by Ctrl-C" in plain_lines(station.text)
