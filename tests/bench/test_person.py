"""The command line with a person at a real terminal, and without one."""

from __future__ import annotations

import os
import pty
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.crash.short import write_files
from tests.support.command_line import SCRIPT
from tests.support.terminal import Terminal, at_terminal
from workbench.model import event as ev
from workbench.session.journal import read_journal
from workbench.session.state import effective

STEPS = """\
format: 1
procedure: p
title: P
steps:
  - {step: ask, text: Which card?, choices: [white, grey]}
  - step: capture_grid
    standoffs_mm: [300, 600]
    repeats: 1
"""


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[Terminal]:
    rig, _ = write_files(tmp_path, STEPS)
    rig.write_text(rig.read_text() + "  answers: false\n")
    with at_terminal(tmp_path, "run", "p.yaml", "--rig", "rig.yaml") as there:
        yield there


def events(folder: Path) -> list[ev.Event]:
    (session,) = [p for p in (folder / "sessions").iterdir() if p.is_dir()]
    return [r.event for r in effective(read_journal(session))]


def test_a_person_is_guided_through_a_session(terminal: Terminal, tmp_path: Path) -> None:
    os.write(terminal.master, b"grey\nyes\n\n\n\n")  # typed ahead: answers nothing
    terminal.wait_for("Step 1 of 2")
    terminal.wait_for("Which card?")
    terminal.type("green")
    terminal.wait_for("expected one of white, grey, got green")
    terminal.type("white")
    terminal.wait_for("will be switched on")
    terminal.type("")
    terminal.wait_for("expected yes")
    terminal.type("yes")
    terminal.wait_for("Place the target at 300 mm")
    terminal.type("400")
    terminal.wait_for("expected 270 to 330 mm")
    terminal.type("302.5 mm")
    terminal.wait_for("placement 1 of 2 done")
    terminal.wait_for("Place the target at 600 mm")
    terminal.wait_for("or redo (300 mm again), skip (leave 600 mm out), abort (end the session)")
    terminal.type("skip")
    terminal.wait_for("Reason for skip (leave 600 mm out)?")
    terminal.type("")  # not meant so: the question comes again
    terminal.wait_for("Place the target at 600 mm")
    terminal.type("redo")
    terminal.wait_for("Reason for redo (300 mm again)?")
    terminal.type("it slipped")
    terminal.wait_for("Place the target at 300 mm")
    terminal.type("")
    terminal.wait_for("Place the target at 600 mm")
    terminal.type("skip")
    terminal.type("no room")
    assert terminal.end() == 0, terminal.text
    assert "Traceback" not in terminal.text
    told = events(tmp_path)
    answers = {e.key: e.answer for e in told if isinstance(e, ev.Answered)}
    assert (answers["p.1"].value, answers["safety"].by) == ("white", "person")
    assert (answers["p.2/600mm"].action, answers["p.2/600mm"].reason) == ("skip", "no room")
    assert [e.placement.standoff_mm for e in told if isinstance(e, ev.TargetPlaced)] == [300.0]
    assert [e.reason for e in told if isinstance(e, ev.SetAside)] == ["it slipped"]
    for line in terminal.text.replace("\r", "\n").split("\n"):
        assert "\x1b" in line or len(line) <= 80 or "sessions/" in line


def test_control_c_at_a_prompt_pauses(terminal: Terminal, tmp_path: Path) -> None:
    terminal.wait_for("> ")
    os.write(terminal.master, b"\x03")
    assert terminal.end() == 5
    assert "stopped by Ctrl-C" in terminal.text
    assert "workbench resume sessions/" in terminal.text
    last = events(tmp_path)[-1]
    assert isinstance(last, ev.SessionFinished)
    assert last.exit_code == 5


def test_the_end_of_input_is_no_answer(terminal: Terminal) -> None:
    terminal.wait_for("> ")
    os.write(terminal.master, b"\x04")
    assert terminal.end() == 6
    assert "prompt p.1" in terminal.text


def test_a_terminal_that_is_closed_stops_the_session_in_good_order(
    terminal: Terminal, tmp_path: Path
) -> None:
    terminal.wait_for("> ")
    os.close(terminal.master)
    assert terminal.process.wait(60) == 5
    last = events(tmp_path)[-1]
    assert isinstance(last, ev.SessionFinished)
    assert last.message == f"stopped by {signal.SIGHUP.name}"


def test_errors_at_the_end_are_wrapped_on_words(terminal: Terminal) -> None:
    terminal.type("white")
    terminal.type("abort")
    terminal.type("the lamp of the door does not go green, and nobody who could tell why is in the house now")
    assert terminal.end() == 5
    lines = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]|\r", "", terminal.text).split("\n")
    (first,) = [n for n, line in enumerate(lines) if line.startswith("error: aborted by the operator")]
    error = [line for line in lines[first:] if line]
    assert len(error) > 1
    assert max(map(len, error)) <= 80
    assert "the lamp of the door does not go green, and nobody who could" in " ".join(error)


SHELL = """
import os, subprocess, sys, time
tty = os.open(sys.argv[1], os.O_RDWR)
for handle in range(3):
    os.dup2(tty, handle)
command = subprocess.Popen(sys.argv[2:])
command.wait()
print("$ ", end="", flush=True)
time.sleep(5)  # the guardian gives up after 1 s
"""


def test_nothing_is_printed_over_the_shell_after_a_kill(tmp_path: Path) -> None:
    """The virtual bench dies with the workbench, so nobody is left to confirm an off; nobody is in danger."""
    rig, _ = write_files(tmp_path, STEPS)
    rig.write_text(rig.read_text() + "  answers: false\n")
    master, slave = pty.openpty()
    environment = {key: value for key, value in os.environ.items() if key != "CI"}
    command = [str(SCRIPT), "run", "p.yaml", "--rig", "rig.yaml"]
    shell = subprocess.Popen(
        [sys.executable, "-c", SHELL, os.ttyname(slave), *command],
        cwd=tmp_path,
        env=environment,
        start_new_session=True,
    )
    terminal = Terminal(shell, master)
    terminal.wait_for("> ")
    (workbench,) = Path(f"/proc/{shell.pid}/task/{shell.pid}/children").read_text().split()
    os.kill(int(workbench), signal.SIGKILL)
    terminal.wait_for("$ ")
    assert terminal.end() == 0
    assert terminal.text[terminal.seen :] == ""
    os.close(slave)
    os.close(master)


@pytest.mark.long_cases
@pytest.mark.parametrize(
    ("option", "why"), [([], "there is no terminal"), (["--no-input"], "--no-input was given")]
)
def test_without_a_terminal_an_open_prompt_ends_it(tmp_path: Path, option: list[str], why: str) -> None:
    rig, _ = write_files(tmp_path, STEPS)
    rig.write_text(rig.read_text() + "  answers: false\n")
    (tmp_path / "answers.yaml").write_text("p.1: white\nsafety: true\n")
    command = [str(SCRIPT), "run", "p.yaml", "--rig", "rig.yaml", "--answers", "answers.yaml", *option]
    environment = {key: value for key, value in os.environ.items() if key != "CI"}
    done = subprocess.run(
        command, cwd=tmp_path, capture_output=True, text=True, stdin=subprocess.DEVNULL, env=environment
    )
    assert done.returncode == 6
    assert "prompt safety" in " ".join(done.stderr.split())
    assert why in " ".join(done.stderr.split())


def test_an_answers_file_is_held_against_the_procedure_before_anything_begins(tmp_path: Path) -> None:
    rig, _ = write_files(tmp_path, STEPS)
    rig.write_text(rig.read_text() + "  answers: false\n")
    (tmp_path / "answers.yaml").write_text("p.1: green\np.2/6000mm: 6000\np.1: white\n")
    command = [str(SCRIPT), "run", "p.yaml", "--rig", "rig.yaml", "--answers", "answers.yaml", "--no-input"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    assert done.returncode == 2
    lines = done.stderr.removeprefix("error: ").splitlines()
    assert [line.split(": ")[:2] for line in lines] == [
        ["answers.yaml:1", "p.1"], ["answers.yaml:2", "p.2/6000mm"], ["answers.yaml:3", "p.1"],
    ]  # fmt: skip
    assert "one of p.2/600mm, p.2/300mm, " in lines[1]
    assert not (tmp_path / "sessions").exists()
