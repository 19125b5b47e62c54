"""`workbench line`: a station that runs procedures on one sensor after another."""

from __future__ import annotations

import re
import sys
import termios
import textwrap
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from workbench.cli.console import print_message
from workbench.cli.refusal import refused_fit
from workbench.cli.report import DEFAULT_NAME, certify
from workbench.cli.run import Screen, resume_session, run_procedures
from workbench.cli.stopping import stop_at_once
from workbench.cli.verdict import and_more, split_reason
from workbench.model import event as ev
from workbench.model.contents import printable
from workbench.model.errors import BadInputError, LimitFailedError, RigNotReadyError, StoppedError
from workbench.model.number_text import counted
from workbench.model.rig import Rig
from workbench.model.rig_text import rig_text_of
from workbench.model.table import PERCENT, Column, Table
from workbench.model.yamlfile import standalone_text
from workbench.procedure.engine.plan import Plan
from workbench.report.terminal_table import TerminalTable
from workbench.session.files import write_atomically
from workbench.session.index import IndexedSession, indexed_sessions
from workbench.session.journal import read_journal
from workbench.session.state import effective

PASSED, FAILED, UNFINISHED = "passed", "FAILED", "unfinished"
RIGS = "rigs"
"""Folder of the sensors' rig files in the folder of sessions."""
SERIAL = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")
"""Serial numbers; they are parts of file names."""
SHOWN = 5
"""Number of sensors in the table."""
RESULT_WIDTH = 46
"""Width of their results in characters: the table fits into 80 columns."""


@dataclass(frozen=True)
class Line:
    """A station of a production line."""

    procedures: tuple[Path, ...]
    rig: Path
    sessions: Path
    operator: str | None

    def run(self) -> None:
        """Ask for serial numbers and run a session for each, until one is empty.

        Raises:
            BadInputError: a file is wrong.
            StoppedError: the command was stopped.
            AnswerNeededError: a prompt of the procedure needs a person.
            LaserOffNotConfirmedError: the beams may be on.
        """
        plan = Plan.load(self.rig, self.procedures)
        self.sessions.mkdir(parents=True, exist_ok=True)
        try:
            while True:
                tally = Tally.of(self._sensors(plan))
                self._show(tally)
                serial = _ask_serial()
                if not serial:
                    break
                if not SERIAL.fullmatch(serial):
                    print_message(
                        f"{serial}: expected a serial number of letters, digits, _, . and -, at most 64"
                    )
                    continue
                self._calibrate(serial, tally.of_serial(serial))
        except StoppedError as error:
            error.add_note(Tally.of(self._sensors(plan)).text)
            raise
        print_message(f"line ended: {tally.text}")

    def _calibrate(self, serial: str, last: Sensor | None) -> None:
        """Run a session of a sensor, or continue its last one; failures are printed."""
        if sys.stderr.isatty():
            Console(stderr=True).clear()
        screen = Screen(view=False, operator=self.operator)
        try:
            if last is not None and last.verdict == UNFINISHED:
                session = last.session
                print_message(f"{serial}: its session {session.name} is continued")
                resume_session(session, None, screen)
            elif last is not None and last.verdict == PASSED and not (last.session / DEFAULT_NAME).exists():
                session = last.session  # it was killed before the certificate
            else:
                session = run_procedures(list(self.procedures), self._rig_file(serial), self.sessions, screen)
            print_message(f"{certify(session)}: {session / DEFAULT_NAME}")
        except LimitFailedError:
            print_message(f"{serial} FAILED: no certificate")  # its verdict has been printed
        except (RigNotReadyError, BadInputError) as error:
            print_message(f"error: {error}", red=True)
            print_message(f"{serial}: scan it again to continue")
        finally:
            stop_at_once()  # the session has left its own handlers

    def _rig_file(self, serial: str) -> Path:
        """Rig file of a sensor, beside its sessions: a resumption reads it again."""
        path = self.sessions / RIGS / f"{serial}.yaml"
        path.parent.mkdir(exist_ok=True)
        write_atomically(path, rig_text_of(standalone_text(self.rig, Rig), serial).encode())
        return path

    def _sensors(self, plan: Plan) -> list[Sensor]:
        """Sensors with a session of these procedures on this rig, that of the last session at the end."""
        names = tuple(one.procedure for one in plan.procedures)
        found: dict[str, Sensor] = {}
        for one in indexed_sessions(self.sessions):
            if (one.status.rig, one.status.procedures) == (plan.rig.rig, names):
                found.pop(one.serial, None)
                found[one.serial] = _sensor(one)
        return list(found.values())

    def _show(self, tally: Tally) -> None:
        """Print the counters and the last sensors."""
        print_message(f"\nLine {self.rig.name}, {' '.join(path.name for path in self.procedures)}")
        print_message(tally.text)
        if tally.sensors:
            Console(stderr=True, markup=False).print(TerminalTable(tally.table()))


@dataclass(frozen=True)
class Sensor:
    """A sensor with its last session."""

    serial: str
    session: Path
    verdict: str
    """PASSED, FAILED or UNFINISHED."""
    result: str
    """Outcome, or reason of a failure, in one line."""


@dataclass(frozen=True)
class Tally:
    """Sensors of a line, counted."""

    sensors: tuple[Sensor, ...]

    @classmethod
    def of(cls, sensors: list[Sensor]) -> Tally:
        """Count sensors."""
        return cls(tuple(sensors))

    def of_serial(self, serial: str) -> Sensor | None:
        """The sensor with a serial number."""
        return next((one for one in self.sensors if one.serial == serial), None)

    @property
    def text(self) -> str:
        """Counters in one line."""
        passed, failed, unfinished = (
            sum(one.verdict == verdict for one in self.sensors) for verdict in (PASSED, FAILED, UNFINISHED)
        )
        yield_text = f", yield {PERCENT * passed / (passed + failed):.1f} %" if passed + failed else ""
        left = f"; {unfinished} unfinished" if unfinished else ""
        return f"{counted(passed + failed, 'sensor')}: {passed} passed, {failed} failed{yield_text}{left}"

    def table(self) -> Table:
        """The last sensors, the latest first."""
        return Table(
            name="line",
            title="Last sensors",
            columns=(
                Column(key="serial", name="serial"),
                Column(key="verdict", name="verdict"),
                Column(key="result", name="result"),
            ),
            rows=tuple(
                (one.serial, one.verdict, textwrap.shorten(one.result, RESULT_WIDTH, placeholder=" ..."))
                for one in reversed(self.sensors[-SHOWN:])
            ),
        )


def _sensor(one: IndexedSession) -> Sensor:
    status = one.status
    if status.state == "finished":
        result = status.calibration or "; ".join(status.trials)
        return Sensor(one.serial, status.session_dir, PASSED, result.removeprefix("accepted: "))
    verdict = FAILED if _is_decided(status.session_dir) else UNFINISHED
    fit = refused_fit(status.session_dir)
    result = split_reason(status.why)[0] if fit is None else and_more(fit.reasons)
    return Sensor(one.serial, status.session_dir, verdict, result)


def _is_decided(session_dir: Path) -> bool:
    """Whether a limit on the sensor ended a session: to continue it would give the same result."""
    try:
        events = [record.event for record in effective(read_journal(session_dir))]
    except BadInputError:  # a damaged journal
        return True
    ends = [one for one in events if isinstance(one, ev.SessionFinished)]
    return bool(ends) and ends[-1].exit_code == LimitFailedError.exit_code


def _ask_serial() -> str:
    """Serial number as scanned; empty at the end of the input. Input before the question is discarded."""
    if sys.stdin.isatty():
        termios.tcflush(sys.stdin, termios.TCIFLUSH)
    print_message("Scan or type the serial number of the next sensor; Enter alone ends.")
    print("> ", end="", file=sys.stderr, flush=True)
    try:
        return printable(sys.stdin.readline().strip())
    except StoppedError:
        print(file=sys.stderr)
        raise
