"""The command line in this process."""

from __future__ import annotations

import os
import signal
import sys

import pytest

from tests.support.command_line import Outcome, Run
from workbench.cli.main import main
from workbench.cli.stopping import SIGNALS


@pytest.fixture
def workbench(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    before = {number: signal.getsignal(number) for number in SIGNALS}

    monkeypatch.setattr(os, "_exit", sys.exit)  # a fit ends at once; the tests' own process goes on

    def run(*arguments: object) -> Outcome:
        monkeypatch.setattr(sys, "argv", ["workbench", *map(str, arguments)])
        code = 0
        try:
            main()
        except SystemExit as stop:
            code = stop.code if isinstance(stop.code, int) else 0
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)
        captured = capsys.readouterr()
        return Outcome(code, captured.out, captured.err)

    return run
