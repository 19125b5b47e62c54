"""`workbench doctor`."""

from __future__ import annotations

import sys
import tempfile
from contextlib import nullcontext
from pathlib import Path

from rich.console import Console
from rich.text import Text

from workbench.cli.stopping import StopAfterCapture
from workbench.cli.terminal_operator import choose_operator
from workbench.devices.registry import load_bench_rig, open_bench
from workbench.model.errors import RigNotReadyError
from workbench.procedure.doctor import examine
from workbench.procedure.engine.operator import operator_of_bench


def examine_rig(rig_path: Path, no_input: bool) -> None:
    """Check every part of a rig and print the results.

    Raises:
        RigNotReadyError: a check failed.
        WorkbenchError: the rig file is wrong, a prompt is not answered, or a beam stays on.
    """
    rig = load_bench_rig(rig_path)
    console = Console(stderr=True, highlight=False, soft_wrap=not sys.stderr.isatty())
    stopping = StopAfterCapture()
    failed = []
    with tempfile.TemporaryDirectory() as folder, open_bench(rig, Path(folder) / "doctor") as bench:
        person = choose_operator(no_input, console, lambda: stopping.reason, nullcontext)
        for finding in examine(rig, bench, operator_of_bench(bench, person)):
            colour, word = ("green", "ok  ") if finding.ok else ("red", "FAIL")
            console.print(Text.assemble((word, colour), f" {finding.part}: {finding.found}"))
            if not finding.ok:
                failed.append(finding.part)
    if failed:
        raise RigNotReadyError(f"rig {rig.rig} is not ready; failed: {', '.join(failed)}")
    console.print(f"rig {rig.rig} is ready", markup=False)
