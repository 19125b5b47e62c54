"""`workbench aim`: place, focus and brightness of every laser's spot, until Ctrl-C."""

from __future__ import annotations

import math
import select
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.live import Live

from workbench.cli.console import print_message
from workbench.cli.live_window import LiveWindow, watching
from workbench.cli.stopping import BY_CTRL_C, StopAfterCapture
from workbench.cli.terminal_operator import choose_operator
from workbench.devices.registry import load_bench_rig, open_bench
from workbench.model.errors import StoppedError
from workbench.model.table import Table
from workbench.procedure.aiming import Aim
from workbench.procedure.engine.operator import operator_of_bench
from workbench.procedure.engine.prompts import safety_prompt
from workbench.report.aim_table import aim_lines, aim_table
from workbench.report.terminal_table import TerminalTable
from workbench.sensor.usable import check_same_sensor, load_usable

if TYPE_CHECKING:  # loads Rerun
    from workbench.viewer.aim_view import Shown
    from workbench.viewer.stream import Stream

LEAST_STANDOFF_MM = 1.0


@dataclass(frozen=True)
class AimRequest:
    """Arguments of the command."""

    rig: Path
    calibration: Path | None
    """Calibration to compare with; None: the rig file."""
    standoff_mm: float | None
    """First standoff; None: not known."""
    no_input: bool = False
    """Whether no person is asked to confirm safety."""
    view: bool = False
    """Whether to show the spots in the viewer."""


def aim_lasers(request: AimRequest) -> None:
    """Read every laser in turn, and show its spot, until Ctrl-C.

    Raises:
        BadInputError: a file is wrong, or the calibration belongs to another sensor.
        AnswerNeededError: there is no operator to confirm safety.
        RigNotReadyError: a device does not answer.
        StoppedError: another signal than that of Ctrl-C was received, or a second one.
        LaserOffNotConfirmedError: a beam may be on.
    """
    rig = load_bench_rig(request.rig)
    calibration = None if request.calibration is None else load_usable(request.calibration)
    if calibration is not None:
        check_same_sensor(rig, calibration)
    stopping = StopAfterCapture()
    # A bench may need a session folder for its files; aiming keeps none.
    with (
        tempfile.TemporaryDirectory(prefix="workbench-aim-") as folder,
        open_bench(rig, Path(folder) / "aim") as bench,
    ):
        person = choose_operator(
            request.no_input, Console(stderr=True, markup=False), lambda: stopping.reason, nullcontext
        )
        answer = operator_of_bench(bench, person).ask(safety_prompt(rig))
        if answer.action != "done":
            raise StoppedError(f"aborted by the operator: {answer.reason}")
        aim = Aim(rig, bench, calibration)
        aim.get_ready()
        print_message("To change the standoff, type it in mm, then Enter. To end, type Ctrl-C.")
        with _window(aim) if request.view else nullcontext() as window, _output() as show:
            _aim_all(aim, request.standoff_mm, stopping, show, window)
    if stopping.reason is not None and stopping.reason != BY_CTRL_C:
        raise StoppedError(stopping.reason)


def _aim_all(
    aim: Aim,
    standoff_mm: float | None,
    stopping: StopAfterCapture,
    show: Callable[[Table], None],
    window: LiveWindow[Shown] | None,
) -> None:
    typed = TypedNumbers()
    aim.place(standoff_mm)
    for number in count():
        readings = []
        for laser_id in aim.rig.laser_ids:
            if stopping.reason is not None:
                return
            readings.append(aim.read(laser_id, number))
        table = aim_table(readings, aim.directions_mrad(), _title(aim))
        show(table)
        if window is not None:
            window.show((tuple(readings), table))
        if (entered := typed.latest()) is not None:
            aim.place(entered)


def _title(aim: Aim) -> str:
    at = "standoff not known" if aim.standoff_mm is None else f"standoff {aim.standoff_mm:g} mm"
    exposure = "exposure of the rig file" if aim.exposure is None else aim.exposure.text
    return f"{at}, {exposure}"


class TypedNumbers:
    """Standoffs typed on standard input while lasers are read; each is a line."""

    def __init__(self) -> None:
        self._open = sys.stdin is not None

    def latest(self) -> float | None:
        """Standoff, mm, that was entered last since the last call; None without one."""
        entered = None
        while self._open and select.select([sys.stdin], [], [], 0.0)[0]:
            line = sys.stdin.readline()
            self._open = line != ""  # end of the input
            if line.strip():
                entered = _standoff(line) or entered
        return entered


def _standoff(line: str) -> float | None:
    """Standoff in a line, mm; None with a message for anything else."""
    try:
        value = float(line.strip().removesuffix("mm").replace(",", "."))
    except ValueError:
        value = math.nan
    if LEAST_STANDOFF_MM <= value < math.inf:
        return value
    print_message(f"expected a standoff of at least {LEAST_STANDOFF_MM:g} mm, got {line.strip()!r}")
    return None


@contextmanager
def _output() -> Iterator[Callable[[Table], None]]:
    """Table redrawn in place on a terminal, otherwise a line for each laser, on standard output."""
    console = Console(highlight=False, markup=False)
    if not console.is_terminal:
        yield lambda table: print(*aim_lines(table), sep="\n", flush=True)
        return
    with Live(console=console, auto_refresh=False) as live:
        yield lambda table: live.update(TerminalTable(table), refresh=True)


def _window(aim: Aim) -> AbstractContextManager[LiveWindow[Shown]]:
    from workbench.viewer.aim_view import AimView, aim_layout

    def view(stream: Stream) -> AimView:
        return AimView(stream, aim.rig)

    return watching(f"aim {aim.rig.rig}", aim_layout(aim.rig), view)
