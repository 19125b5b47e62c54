"""Page of the commands, from the program that parses them."""

from __future__ import annotations

import html
from collections.abc import Iterator
from typing import Any

import typer

from workbench.cli.main import app

HEAD = """\
# Commands

Every command with its arguments and options, as `workbench COMMAND --help` prints them. Exit codes: 0 done,
1 internal error, 2 usage or bad input, 3 a limit failed, 4 rig not ready, 5 stopped, 6 an answer is needed,
7 laser-off not confirmed.
"""


def commands_page() -> str:
    """Markdown of all commands."""
    commands = _commands(typer.main.get_command(app), "workbench")
    return "\n".join([HEAD, *(line for name, command in commands for line in _lines(name, command))])


def _commands(command: Any, name: str) -> Iterator[tuple[str, Any]]:
    """Commands that do something, with their full names."""
    inner = getattr(command, "commands", None)
    if inner is None:
        yield name, command
    else:
        for part, one in inner.items():
            yield from _commands(one, f"{name} {part}")


def _lines(name: str, command: Any) -> Iterator[str]:
    context = command.make_context(name, [], resilient_parsing=True)
    usage = " ".join([name, *command.collect_usage_pieces(context)])
    yield from (f"## {name}", "", command.help or "", "", "```", usage, "```", "")
    records = [record for one in command.params if (record := one.get_help_record(context))]
    if records:
        yield from ("| argument or option | meaning |", "|---|---|")
        yield from (f"| `{_cell(key)}` | {html.escape(_cell(text), quote=False)} |" for key, text in records)
        yield ""


def _cell(text: str) -> str:
    """Text in one cell of a table."""
    return " ".join(text.split()).replace("|", "\\|")
