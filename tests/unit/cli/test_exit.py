"""The end of the program: signals, output that nobody takes."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.command_line import SCRIPT, shell
from workbench.cli.exit import report
from workbench.model.errors import LaserOffNotConfirmedError, StoppedError

ROOT = Path(__file__).parents[3]
WEBCAM = ROOT / "data/webcam-laser-rows.csv"
WEBCAM_RIG = ROOT / "rigs/webcam-laser.yaml"


def test_a_signal_at_the_very_end_changes_nothing(tmp_path: Path) -> None:
    """The interpreter's own end gives signals their default back; objects of this module end later."""
    late = """
import os, signal, sys
class Late:
    def __del__(self, kill=os.kill, me=os.getpid(), number=signal.SIGINT, write=os.write):
        write(1, b"late")
        kill(me, number)
late = Late()
from workbench.calibration.verdict.tables import derived_table
from workbench.cli.main import main
main()
"""
    command = [sys.executable, "-c", late, "sessions", "--sessions", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stdout) == (0, "late")


def test_output_that_is_lost_is_said(tmp_path: Path) -> None:
    (tmp_path / "s").mkdir()
    (tmp_path / "s/session.yaml").write_text("format: 1\n")
    done = shell(f"'{SCRIPT}' sessions --sessions '{tmp_path}' --json >/dev/full")
    assert (done.returncode, done.stdout) == (5, "")
    assert "cannot be written: No space left" in done.stderr


def test_a_fit_whose_result_nobody_reads_ends_as_stopped(tmp_path: Path) -> None:
    """The calibration is on disk; what is left of the output finds its pipe closed, or its disk full."""
    output = tmp_path / "webcam.yaml"
    command: list[str | Path] = [SCRIPT, "fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", output, "--json"]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True)
    assert (done.returncode, output.is_file()) == (5, True), done.stderr
    assert "cannot be written: No space left" in done.stderr
    assert "Traceback" not in done.stderr


def test_lasers_that_may_be_on_come_before_the_resumption(capsys: pytest.CaptureFixture[str]) -> None:
    unsafe, stopped = LaserOffNotConfirmedError("cut the power"), StoppedError("interrupted")
    for error in (unsafe, stopped):
        error.add_note("resume:  workbench resume s")
    stopped.__context__ = unsafe
    assert report(stopped) == 7
    printed = capsys.readouterr().err
    assert printed.index("cut the power") < printed.index("resume:")
    assert printed.count("resume:") == 1
    assert report(stopped.__class__("interrupted")) == 5
