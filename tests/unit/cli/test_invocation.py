"""The command line, for the record."""

from __future__ import annotations

import shlex
import sys

import pytest

from workbench.cli.invocation import command_line


def test_the_command_can_be_typed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    arguments = ["fit", "my captures.csv", "--accept", "it's $5; all right"]
    monkeypatch.setattr(sys, "argv", ["/usr/bin/workbench", *arguments])
    assert shlex.split(command_line()) == ["workbench", *arguments]
