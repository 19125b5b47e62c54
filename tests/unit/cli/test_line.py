"""A station at a real terminal: sensors one after another, counters, a failure, kills and stops."""

from __future__ import annotations

import fcntl
import io
import os
import pty
import select
import shlex
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.crash.short import CALIBRATION, write_files
from tests.support.command_line import Outcome, Run, refused
from tests.support.killed_session import wait_for_capture
from tests.support.terminal import at_terminal, plain_lines
from workbench.calibration.selection import model_terms
from workbench.cli import line
from workbench.cli.terminal_operator import LOOK_S
from workbench.emulator.controller import Controller
from workbench.model.errors import StoppedError
from workbench.session.index import indexed_sessions
from workbench.session.journal import JOURNAL

COMMAND = ("line", "p.yaml", "--rig", "rig.yaml", "--sessions", "s")
MESSAGE = "format: 1\nprocedure: p\ntitle: T\nsteps:\n  - {step: message, text: Hello.}\n"
"""A procedure without lasers: fast."""


@pytest.fixture
def files(tmp_path: Path) -> Path:
    write_files(tmp_path, CALIBRATION)
    return tmp_path


@pytest.fixture
def station(files: Path, workbench: Run, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Outcome]:
    """The command in this process, without a terminal; its arguments are the lines that a scanner types."""
    monkeypatch.chdir(files)

    def run(*lines: bytes) -> Outcome:
        typed = io.BytesIO(b"".join(one + b"\n" for one in lines))
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(typed, encoding="utf-8"))
        outcome = workbench(*COMMAND)
        assert "Traceback" not in outcome.err
        return outcome

    return run


Station = Callable[..., Outcome]


def signalled(monkeypatch: pytest.MonkeyPatch, module: object, name: str, number: signal.Signals) -> None:
    """Have a signal come at the first call of a function."""
    called, left = getattr(module, name), [number]

    def call(*arguments: object, **options: object) -> object:
        if left:
            os.kill(os.getpid(), left.pop())
        return called(*arguments, **options)

    monkeypatch.setattr(module, name, call)


def unfinished(station: Station, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Session of SN-1 that was stopped when the first laser was switched on."""
    with monkeypatch.context() as patch:
        signalled(patch, Controller, "_on", signal.SIGINT)
        assert station(b"SN-1").code == 5
    (one,) = indexed_sessions(Path("s"))
    assert one.status.state == "stopped"
    return one.status.session_dir


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


@pytest.mark.parametrize(
    ("module", "name", "number"),
    [
        (model_terms, "fit_calibration", signal.SIGINT),
        (line, "certify", signal.SIGINT),
        (model_terms, "fit_calibration", signal.SIGTERM),
        (line, "certify", signal.SIGTERM),
    ],
)
def test_a_signal_after_the_captures_ends_the_line_after_the_sensor(
    station: Station, monkeypatch: pytest.MonkeyPatch, module: object, name: str, number: signal.Signals
) -> None:
    signalled(monkeypatch, module, name, number)
    outcome = station(b"SN-1", b"SN-2")
    by = "Ctrl-C" if number == signal.SIGINT else "SIGTERM"
    refused(outcome, 5, f"stopped by {by}", "1 sensor: 1 passed, 0 failed, yield 100.0 %")
    assert outcome.err.splitlines()[-1] == "1 sensor: 1 passed, 0 failed, yield 100.0 %"
    (one,) = indexed_sessions(Path("s"))
    assert (one.serial, one.status.state) == ("SN-1", "finished")
    assert (one.status.session_dir / "certificate.html").is_file()


def test_a_signal_during_a_session_without_certificate_ends_the_line(
    files: Path, station: Station, monkeypatch: pytest.MonkeyPatch
) -> None:
    (files / "p.yaml").write_text(CALIBRATION.replace("max_relative_range_sd: 0.5", "max_rms_px: 0.0001"))
    signalled(monkeypatch, model_terms, "fit_calibration", signal.SIGINT)
    refused(station(b"SN-1", b"SN-2"), 5, "SN-1 FAILED", "stopped by Ctrl-C", "0 passed, 1 failed")


def test_lasers_are_off_after_ctrl_c(station: Station, monkeypatch: pytest.MonkeyPatch) -> None:
    """The signal comes when the first laser is switched on; the last command is off, and confirmed."""
    obey, verbs, controllers = Controller._obey, list[str](), set[Controller]()

    def recorded(controller: Controller, command: str) -> str:
        controllers.add(controller)
        verbs.append(command.partition(" ")[0])
        return obey(controller, command)

    monkeypatch.setattr(Controller, "_obey", recorded)
    signalled(monkeypatch, Controller, "_on", signal.SIGINT)
    refused(station(b"SN-1", b"SN-2"), 5, "stopped by Ctrl-C", "0 failed; 1 unfinished")
    assert {"ON", "MASK"} & set(verbs)
    assert verbs[-2:] == ["OFF", "STATE?"]
    assert [one.lit() for one in controllers] == [()]


def test_lasers_that_may_be_on_end_the_line(files: Path, station: Station) -> None:
    rig = files / "rig.yaml"
    rig.write_text(rig.read_text() + "  controller: {fault: ignores_off}\n")
    refused(station(b"SN-1", b"SN-2"), 7, "treat the beams as on", "0 sensors: 0 passed, 0 failed")


def test_a_controller_that_does_not_answer_leaves_the_line_running(files: Path, station: Station) -> None:
    rig = files / "rig.yaml"
    text = rig.read_text()
    rig.write_text(text + "  controller: {fault: silent}\n")
    refused(station(b"SN-1", b"SN-2"), 0, "error: ", "SN-1: scan it again", "SN-2: scan it again")
    rig.write_text(text)
    refused(station(b"SN-1"), 0, "line ended: 1 sensor: 1 passed, 0 failed")


@pytest.mark.parametrize(
    ("typed", "shown"),
    [
        (b"..", ".."),
        (b"../SN-1", "../SN-1"),
        (b"a/b", "a/b"),
        (b"unknown", "unknown"),
        (b"S" * 61, "S" * 60 + "..."),
        (b"SN-1" * 2500, "SN-1" * 15 + "..."),
        (b"SN-\xfc1", "SN-\\xfc1"),
        (b"SN\x1b[2J", "SN\\x1b[2J"),
        ("SN-\u0661".encode(), "SN-\u0661"),
    ],
)
def test_what_is_no_serial_number_is_asked_again(
    files: Path, station: Station, typed: bytes, shown: str
) -> None:
    outcome = station(typed, typed)
    refused(outcome, 0, "line ended: 0 sensors")
    assert outcome.err.count(f"{shown}: expected a serial number") == 2
    assert max(map(len, outcome.err.splitlines())) < 160
    assert sorted(path.name for path in (files / "s").rglob("*")) == [".sessions.sqlite3", "rigs"]


def test_a_serial_number_may_be_the_name_of_a_file_of_sessions(files: Path, station: Station) -> None:
    (files / "p.yaml").write_text(MESSAGE)
    serials = ("session", "journal", "S" * 60)
    refused(station(*(one.encode() for one in serials)), 0, "line ended: 3 sensors: 3 passed, 0 failed")
    assert sorted(one.serial for one in indexed_sessions(files / "s")) == sorted(serials)
    assert "damaged" not in station().err


def test_a_folder_of_sessions_that_is_none(files: Path, station: Station) -> None:
    (files / "s").write_text("a file")
    refused(station(b"SN-1"), 2, "s: expected a folder for the sessions of the line")
    (files / "s").unlink()
    (files / "s").mkdir()
    (files / "s/rigs").write_text("a file")
    refused(station(b"SN-1"), 2, "s/rigs: expected a folder")
    (files / "p.yaml").unlink()
    refused(station(b"SN-1"), 2, "p.yaml")


def test_changes_are_accepted_by_the_command_that_is_printed(
    files: Path, station: Station, workbench: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = unfinished(station, monkeypatch)
    (files / "p.yaml").write_text(CALIBRATION.replace("max_relative_range_sd: 0.5", "max_rms_px: 0.5"))
    outcome = station(b"SN-1")
    refused(
        outcome, 0, "p.yaml has changed since the session began", "SN-1: undo the changes", "1 unfinished"
    )
    (printed,) = [one for one in outcome.err.splitlines() if "--accept-changes" in one]
    program, *arguments = shlex.split(printed)
    assert (program, arguments[-1]) == ("workbench", "TEXT")
    assert workbench(*arguments[:-1], "another limit", "--no-view").code == 0
    refused(station(b"SN-1"), 0, "1 sensor: 1 passed, 0 failed")
    (one,) = indexed_sessions(files / "s")
    assert (session / "certificate.html").is_file()
    assert one.status.state == "finished"


def test_two_stations_share_a_folder(files: Path, station: Station, monkeypatch: pytest.MonkeyPatch) -> None:
    """One has shown its counters when the other one finishes the session."""
    session = unfinished(station, monkeypatch)
    with (session / JOURNAL).open("rb+") as journal:  # as the other station does while it runs
        fcntl.flock(journal, fcntl.LOCK_EX)
        refused(station(b"SN-1"), 0, "another station, is running it", "SN-1: scan it again")
    with at_terminal(files, *COMMAND) as other:
        other.wait_for("1 unfinished")
        refused(station(b"SN-1"), 0, "is continued", "1 sensor: 1 passed, 0 failed")
        other.type("SN-1")
        other.wait_for("1 sensor: 1 passed, 0 failed")
        other.type("")
        assert other.end() == 0
    assert "cannot be resumed" not in other.text
    assert [one.status.state for one in indexed_sessions(files / "s")] == ["finished"] * 2


def test_the_last_session_is_so_by_its_records(files: Path, station: Station) -> None:
    """Names of folders have local time, which is set back in autumn."""
    (files / "p.yaml").write_text(MESSAGE)
    assert station(b"SN-1", b"SN-2").code == 0
    first, second = indexed_sessions(files / "s")
    assert (first.serial, second.serial) == ("SN-1", "SN-2")
    first.status.session_dir.rename(files / "s/20991231-235959-p")
    rows = [one.split()[0] for one in station().err.splitlines() if one.startswith("SN-")]
    assert rows == ["SN-2", "SN-1"]


def test_damaged_sessions_are_counted_apart(files: Path, station: Station) -> None:
    (files / "p.yaml").write_text(MESSAGE)
    assert station(b"SN-1", b"SN-2", b"SN-3").code == 0
    for one in indexed_sessions(files / "s")[:2]:
        (one.status.session_dir / JOURNAL).write_text("damaged\n")
    text = "1 sensor: 1 passed, 0 failed, yield 100.0 %; 2 damaged sessions not counted"
    refused(station(), 0, f"line ended: {text}")


def test_a_signal_just_before_the_read_ends_the_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """A read that blocks would not notice it: the terminal has no input, as if no scanner were there."""
    master, slave = pty.openpty()
    waits, select_ = list[float](), select.select

    def waiting(*arguments: Any) -> object:
        waits.append(arguments[-1])
        if len(waits) == 2:
            raise StoppedError("stopped by SIGINT")
        return select_(*arguments)

    with os.fdopen(slave, encoding="utf-8") as terminal:
        monkeypatch.setattr("sys.stdin", terminal)
        monkeypatch.setattr("workbench.cli.line.select.select", waiting)
        with pytest.raises(StoppedError):
            line._ask_serial()
    os.close(master)
    assert waits == [LOOK_S] * 2, "the wait has an end, after which signals are handled"


def test_ctrl_c_at_the_question_ends_the_line(files: Path) -> None:
    with at_terminal(files, *COMMAND) as station:
        station.wait_for("> ")
        os.kill(station.process.pid, signal.SIGINT)
        assert station.end() == 5
    assert "stopped by Ctrl-C" in plain_lines(station.text)
