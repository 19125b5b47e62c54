"""The command line: what holds for every command."""

from __future__ import annotations

import ast
import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.command_line import Run, refused
from workbench.model.errors import BadInputError, LaserOffNotConfirmedError, StoppedError

ROOT = Path(__file__).parents[3]
WEBCAM = ROOT / "data/webcam-laser-rows.csv"
WEBCAM_RIG = ROOT / "rigs/webcam-laser.yaml"
HEAVY = (
    *("jax", "matplotlib", "numpy", "scipy", "cv2", "pandas", "rerun", "optimistix", "serial", "pydantic"),
    *("ruamel", "rich.table"),
)


def loaded(*arguments: object) -> tuple[list[str], str]:
    """Libraries of HEAVY that a command loads, and its standard output."""
    code = (
        "import sys\n"
        f"sys.argv = ['workbench', *{[str(one) for one in arguments]}]\n"
        "from workbench.cli.main import main\n"
        "try: main()\n"
        f"finally: print([m for m in {HEAVY} if m in sys.modules], file=sys.stderr)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return ast.literal_eval(done.stderr.splitlines()[-1]), done.stdout


def test_help_imports_nothing_heavy() -> None:
    heavy, text = loaded("--help")
    assert heavy == []
    for command in ("run", "fit", "range", "view"):
        assert command in text


def test_a_check_of_a_rig_loads_no_library_of_fits() -> None:
    heavy, _ = loaded("check", ROOT / "rigs/thesis-emulated.yaml")
    assert not {"jax", "pandas", "optimistix", "rerun"} & set(heavy)


def test_the_command_is_installed() -> None:
    script = Path(sys.executable).with_name("workbench")
    done = subprocess.run([script, "--help"], capture_output=True, text=True, check=True)
    assert "laser-spot range sensors" in done.stdout


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO])
@pytest.mark.parametrize("name", [None, "calibration.yaml"])
def test_a_failed_write_is_no_defect(
    workbench: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, number: int, name: str | None
) -> None:
    def fail(*_: object) -> None:
        raise OSError(number, os.strerror(number), name)

    monkeypatch.setattr("workbench.cli.sessions.list_sessions", fail)
    refused(workbench("sessions", "--sessions", tmp_path), 5, name or "", os.strerror(number))


def test_another_error_of_the_system_is_a_defect(workbench: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise OSError(errno.EBADF, "bad")

    monkeypatch.setattr("workbench.cli.sessions.list_sessions", fail)
    outcome = workbench("sessions")
    assert outcome.code == 1
    assert "internal error" in outcome.err
    assert "Traceback" in outcome.err


def test_a_beam_that_may_be_on_is_told_whatever_came_on_top_of_it(
    workbench: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        try:
            raise LaserOffNotConfirmedError("treat the beams as on")
        finally:
            try:
                raise BadInputError("then this")
            finally:
                raise StoppedError("and that")

    monkeypatch.setattr("workbench.cli.sessions.list_sessions", fail)
    refused(workbench("sessions"), 7, "error: treat the beams as on")


PNG = b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 2


def test_usage(workbench: Run) -> None:
    refused(workbench("fit", WEBCAM), 2, "--output")
    refused(workbench("dance"), 2, "dance")


def test_missing_files(workbench: Run, tmp_path: Path) -> None:
    no = tmp_path / "no.yaml"
    refused(workbench("fit", WEBCAM, "--rig", no, "-o", tmp_path / "c"), 2, no)
    fit = workbench("fit", no, "--rig", WEBCAM_RIG, "-o", tmp_path / "c")
    refused(fit, 2, no)
    refused(workbench("range", WEBCAM, "--calibration", no), 2, no)
    refused(workbench("run", no, "--rig", WEBCAM_RIG, "--sessions", tmp_path), 2, no)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", ["fit {} -o c.yaml --rig {rig}", "range {} --calibration {cal}"])
def test_a_file_of_another_kind_is_refused_as_captures(workbench: Run, tmp_path: Path, command: str) -> None:
    cal, wrong = tmp_path / "cal.yaml", tmp_path / "wrong"
    workbench("fit", WEBCAM, "--rig", WEBCAM_RIG, "-o", cal)
    line = command.format(wrong, rig=WEBCAM_RIG, cal=cal).split()
    wrong.write_bytes(PNG)
    refused(workbench(*line), 2, f"{wrong}: ", "got a PNG image")
    wrong.write_bytes(cal.read_bytes())
    refused(workbench(*line), 2, f"{wrong}: ", "got a calibration")


@pytest.mark.parametrize(
    "line", ["check {}", "plan {} --rig {rig}", "run {} --rig {rig}", "design --rig {}", "doctor {}",
             "compare {} {}", "range --rig {rig} --calibration {}", "target --pdf a.pdf --rig {}",
             "lasers off --rig {}"],
)  # fmt: skip
def test_a_picture_is_refused_as_yaml(workbench: Run, tmp_path: Path, line: str) -> None:
    wrong = tmp_path / "wrong"
    wrong.write_bytes(PNG)
    outcome = workbench(*line.format(wrong, wrong, rig=ROOT / "rigs/thesis-emulated.yaml").split())
    refused(outcome, 2, f"{wrong}: ", "got a PNG image")


def test_a_folder_of_another_kind_is_refused(workbench: Run, tmp_path: Path) -> None:
    file = tmp_path / "f"
    file.write_text("")
    rig, procedure = ROOT / "rigs/thesis-emulated.yaml", ROOT / "procedures/calibrate-flat.yaml"
    refused(workbench("fit", tmp_path, "-o", file), 2, f"{tmp_path}: ", "session.yaml")
    refused(workbench("sessions", "--sessions", file), 2, f"{file}: ")
    refused(
        workbench("plan", procedure, "--rig", rig, "--sessions", file),
        2,
        f"{file}: ",
    )


@pytest.mark.parametrize("group", [[], ["lasers"]])
def test_no_summary_of_a_command_is_cut(
    workbench: Run, monkeypatch: pytest.MonkeyPatch, group: list[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    outcome = workbench(*group, "--help")
    assert outcome.code == 0
    commands = outcome.out.partition("Commands:")[2].strip().splitlines()
    assert len(commands) >= 2
    assert not [line for line in commands if line.endswith("...")]
