"""What ends a session early: signals, a beam that stays on, files that contradict themselves."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import pytest

from workbench.model.event import CaptureTaken, SessionFinished
from workbench.session.journal import JOURNAL, read_journal

ROOT = Path(__file__).parents[2]
SCRIPT = Path(sys.executable).with_name("workbench")
RIG = (ROOT / "rigs/thesis-emulated.yaml").read_text()
IGNORES_OFF = "  controller: {fault: ignores_off}\n"
SHORT = """\
format: 1
procedure: short
title: Short
steps:
  - step: capture_grid
    standoffs_mm: [300, 500, 900]
    repeats: 100
"""


def start(
    folder: Path, rig: str = RIG, procedure: str = SHORT, program: Sequence[str] = (str(SCRIPT),)
) -> subprocess.Popen[str]:
    (folder / "rig.yaml").write_text(rig)
    (folder / "p.yaml").write_text(procedure)
    command = [*program, "run", "p.yaml", "--rig", "rig.yaml"]
    return subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, text=True)


LIT = "first laser lit"
PRINTS_LIT = f"""\
import sys
from workbench.cli.main import main
from workbench.devices.guardian_client import GuardianClient
ask = GuardianClient.ask
def asked(client, line):
    answer = ask(client, line)
    if line.startswith("LIT"):
        print("{LIT}", file=sys.stderr, flush=True)
    return answer
GuardianClient.ask = asked
main()
"""


def session_of(folder: Path) -> Path | None:
    found = [p for p in (folder / "sessions").glob("*") if p.is_dir()]
    return found[0] if found else None


def wait_for_captures(folder: Path, process: subprocess.Popen[str]) -> Path:
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and process.poll() is None:
        session = session_of(folder)
        journal = None if session is None else session / JOURNAL
        if session and journal and journal.exists() and journal.read_text().count("capture_taken") > 5:
            return session
        time.sleep(0.05)
    raise AssertionError(f"no captures: {process.stderr.read() if process.stderr else ''}")


@pytest.mark.parametrize(
    ("number", "times"),
    [
        (signal.SIGINT, 3),
        (signal.SIGTERM, 1),
        (signal.SIGHUP, 1),
        *(
            pytest.param(*case, marks=pytest.mark.thorough)
            for case in ((signal.SIGINT, 1), (signal.SIGTERM, 3), (signal.SIGHUP, 3))
        ),
    ],
)
def test_a_signal_stops_in_good_order(tmp_path: Path, number: signal.Signals, times: int) -> None:
    process = start(tmp_path)
    session = wait_for_captures(tmp_path, process)
    for _ in range(times):
        process.send_signal(number)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 5
    assert f"stopped by {'Ctrl-C' if number == signal.SIGINT else number.name}" in err
    assert "Traceback" not in err
    records = list(read_journal(session))
    last = records[-1].event
    assert isinstance(last, SessionFinished)
    assert last.exit_code == 5
    for shot in (r.event for r in records if isinstance(r.event, CaptureTaken)):
        assert (session / shot.on.path).is_file()


def test_a_beam_that_stays_on_is_seen_in_the_dark_frame(tmp_path: Path) -> None:
    process = start(tmp_path, RIG + "  controller: {fault: hides_stuck_beam}\n")
    _, err = process.communicate(timeout=60)
    assert process.returncode == 7
    assert "cut the lasers' supply" in " ".join(err.split())
    session = session_of(tmp_path)
    assert session is not None
    assert sum(isinstance(r.event, CaptureTaken) for r in read_journal(session)) == 1


def test_a_controller_that_does_not_confirm_is_not_believed(tmp_path: Path) -> None:
    process = start(tmp_path, RIG + IGNORES_OFF)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 7, err


@pytest.mark.parametrize("after_s", [0.0, pytest.param(0.15, marks=pytest.mark.thorough), 0.5])
def test_stops_do_not_take_the_place_of_an_off_that_is_not_confirmed(tmp_path: Path, after_s: float) -> None:
    """Two SIGINT, counted from the first lit laser; before it, there is nothing to switch off."""
    process = start(tmp_path, RIG + IGNORES_OFF, program=(sys.executable, "-c", PRINTS_LIT))
    assert process.stderr is not None
    while LIT not in process.stderr.readline():
        assert process.poll() is None
    time.sleep(after_s)
    for _ in range(2):
        process.send_signal(signal.SIGINT)
        time.sleep(0.05)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 7, err
    assert "treat the beams as on" in " ".join(err.split())


def test_an_off_that_is_not_confirmed_without_standard_error(tmp_path: Path) -> None:
    (tmp_path / "rig.yaml").write_text(RIG + IGNORES_OFF)
    (tmp_path / "p.yaml").write_text(SHORT)
    line = f"'{SCRIPT}' run p.yaml --rig rig.yaml --no-input 2>&-"
    done = subprocess.run(["sh", "-c", line], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (7, "")
    session = session_of(tmp_path)
    assert session is not None
    assert list(read_journal(session)), "nothing else was written into it"


@pytest.mark.parametrize(
    ("steps", "words"),
    [
        ("  - step: export\n", "export needs a step before it that gives fit"),
        ("  - step: fit\n", "fit needs a step before it that gives captures"),
        (
            "  - step: accuracy_trial\n    standoffs_mm: [500]\n    readings: 1\n",
            "accuracy_trial needs a step before it that gives calibration",
        ),
    ],
)
def test_a_procedure_that_cannot_end_does_not_begin(tmp_path: Path, steps: str, words: str) -> None:
    process = start(tmp_path, RIG, SHORT[: SHORT.index("  - step")] + steps)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 2
    assert words in " ".join(err.split())
    assert not (tmp_path / "sessions").exists()


def test_an_emulator_block_that_is_wrong_leaves_no_session(tmp_path: Path) -> None:
    process = start(tmp_path, RIG + "  sneed: 1\n")
    _, err = process.communicate(timeout=60)
    assert process.returncode == 2
    assert "sneed" in err
    assert session_of(tmp_path) is None


def test_sessions_that_cannot_be_kept(tmp_path: Path) -> None:
    (tmp_path / "sessions").write_text("a file")
    process = start(tmp_path)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 2
    assert "the folder of sessions cannot be created" in " ".join(err.split())
