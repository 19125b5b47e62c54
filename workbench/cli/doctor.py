"""`workbench doctor`."""

from __future__ import annotations

import os
import sys
import tempfile
import textwrap
from contextlib import nullcontext
from pathlib import Path

from rich.console import Console
from rich.padding import Padding
from rich.text import Text

from workbench.cli.found_devices import FoundDevice, found_cameras, found_ports
from workbench.cli.stopping import StopAfterCapture
from workbench.cli.terminal_operator import choose_operator
from workbench.devices.registry import load_bench_rig
from workbench.model.contents import printable
from workbench.model.errors import RigNotReadyError
from workbench.model.rig import Rig
from workbench.procedure.doctor import CheckResult
from workbench.procedure.doctor import examine_rig as examine
from workbench.procedure.engine.operator import operator_of_bench

RESULTS = {True: ("green", "ok  "), False: ("red", "FAIL")}
WORDS = {"noted": ("yellow", "note"), "not checked": ("yellow", "----")}
INDENT = 5
"""Width of the column of results in characters."""


def examine_rig(rig_path: Path, no_input: bool) -> None:
    """Check every part of a rig and print the results.

    Raises:
        RigNotReadyError: a check failed.
        WorkbenchError: the rig file is wrong, a prompt is not answered, or a beam stays on.
    """
    rig = load_bench_rig(rig_path)
    console = Console(stderr=True, highlight=False, soft_wrap=not sys.stderr.isatty())
    stopping = StopAfterCapture()
    person = choose_operator(no_input, console, lambda: stopping.reason, nullcontext)
    failed = []
    with tempfile.TemporaryDirectory() as folder:
        for result in examine(rig, Path(folder) / "doctor", lambda bench: operator_of_bench(bench, person)):
            _print(console, result)
            if not result.ok:
                failed.append(result.part)
                if (hint := _hint(rig, result.part)) is not None:
                    console.print(Padding(Text(hint), (0, 0, 0, INDENT)))
    if failed:
        raise RigNotReadyError(f"rig {rig.rig} is not ready; failed: {', '.join(failed)}")
    console.print(f"rig {rig.rig} is ready", markup=False)


def _print(console: Console, result: CheckResult) -> None:
    colour, word = WORDS[result.kind] if result.kind != "checked" else RESULTS[result.ok]
    text = printable(f"{result.part}: {result.found}")
    if console.is_terminal:
        room = console.width - INDENT
        text = textwrap.fill(text, room, break_long_words=False, break_on_hyphens=False)
    console.print(Text.assemble((word, colour), " ", textwrap.indent(text, " " * INDENT).lstrip()))


def _hint(rig: Rig, part: str) -> str | None:
    """Devices that are connected, or missing permission, after a device could not be used."""
    if part == "camera":
        return _devices(_setting(rig, "camera", "source"), found_cameras(), "camera", "video")
    if part == "controller":
        return _devices(_setting(rig, "lasers", "port"), found_ports(), "serial port", "dialout")
    return None


def _setting(rig: Rig, kind: str, key: str) -> str:
    return "" if rig.devices is None else str(getattr(rig.devices, kind).model_dump().get(key, ""))


def _devices(path: str, found: list[FoundDevice], what: str, group: str) -> str | None:
    if path.startswith("/dev/") and Path(path).exists():
        if os.access(path, os.R_OK | os.W_OK):
            return None
        return f"This user may not open {path}: sudo usermod -aG {group} $USER, then log in again."
    if not path.startswith("/dev/") and not path.isdigit():
        return None  # a stream or a file
    if not found:
        return f"No {what} is connected to this computer."
    return f"Connected: {', '.join(f'{one.path} ({one.name})' for one in found)}."
