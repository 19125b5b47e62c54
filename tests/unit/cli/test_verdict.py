"""Verdict on one screen."""

from __future__ import annotations

import shlex
import sys

import click
import pytest

from workbench.cli.verdict import Verdict, and_more, command_lines, show_verdict, split_reason

COMMAND = [
    "workbench",
    "repair",
    "sessions/a b",
    "--recapture",
    "p.1/300mm",
    "--reason",
    "it's off",
    "--add",
    "5",
]
VERDICT = Verdict(
    word="REFUSED",
    headline="the captures " + "contradict the others " * 8,
    action="check " * 30,
    commands=[COMMAND, ["workbench", "resume", "s"]],
    notes=["a note " * 20],
    labelled=[("session:", "sessions/" + "x" * 90)],
)


@pytest.mark.parametrize("width", [30, 60, 80, 120, None])
def test_a_command_in_several_lines_is_the_same_command_to_a_shell(width: int | None) -> None:
    lines = command_lines(COMMAND, width)
    joined = "\n".join(lines).replace("\\\n", "")
    assert shlex.split(joined) == COMMAND
    assert all(line.endswith(" \\") for line in lines[:-1])
    if width is None:
        assert len(lines) == 1
    elif width >= 60:
        assert max(map(len, lines)) <= width


@pytest.mark.parametrize("width", [60, 80, 120])
def test_all_but_paths_fits_the_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], width: int
) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    show_verdict(VERDICT)
    lines = click.unstyle(capsys.readouterr().err).strip().splitlines()
    assert lines[0].startswith("REFUSED ")
    assert max(len(line) for line in lines if not line.startswith("session:")) <= width
    assert len(lines) <= 24


def test_without_a_terminal_each_part_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    show_verdict(VERDICT)
    lines = capsys.readouterr().err.strip().splitlines()
    assert [line.split()[0] for line in lines] == ["REFUSED", "do:", "then:", "or:", "note:", "session:"]
    assert shlex.split(lines[2])[1:] == COMMAND


def test_the_first_command_is_what_to_do_where_no_words_state_it(capsys: pytest.CaptureFixture[str]) -> None:
    show_verdict(Verdict(word="REFUSED", headline="r", commands=[COMMAND, COMMAND]))
    assert [line.split()[0] for line in capsys.readouterr().err.strip().splitlines()] == [
        "REFUSED",
        "do:",
        "or:",
    ]


def test_a_reason_is_parted_into_cause_and_remedy() -> None:
    assert split_reason("it is dark. Do: switch on. Then wait") == ("it is dark", "switch on. Then wait")
    assert split_reason("it is dark") == ("it is dark", "")


def test_reasons_of_other_kinds_are_counted() -> None:
    assert and_more(["a. Do: b"]) == "a"
    assert and_more(["x L1. Do: b", "x L2. Do: b", "rms 2 px. Do: c"]).startswith(
        "x L1; likewise L2 (and 1 more"
    )
