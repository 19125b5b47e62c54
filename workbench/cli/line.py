"""`workbench line`: a station that runs procedures on one sensor after another."""

from __future__ import annotations

import re
import select
import shlex
import sys
import termios
import textwrap
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from functools import lru_cache
from pathlib import Path

import typer
from rich.console import Console

from workbench.cli.console import print_message
from workbench.cli.option_types import REASON_PLACEHOLDER
from workbench.cli.refusal import refused_fit
from workbench.cli.report import DEFAULT_NAME, certify
from workbench.cli.run import Screen, resume_session, run_procedures
from workbench.cli.stopping import StopAfterCapture, stop_at_once
from workbench.cli.terminal_operator import LOOK_S
from workbench.cli.verdict import and_more, split_reason
from workbench.model import event as ev
from workbench.model.contents import printable
from workbench.model.errors import (
    BadInputError,
    LimitFailedError,
    RigNotReadyError,
    StoppedError,
    WorkbenchError,
)
from workbench.model.number_text import counted
from workbench.model.rig import UNKNOWN_SERIAL, Rig
from workbench.model.rig_text import rig_text_of
from workbench.model.table import PERCENT, Column, Table
from workbench.model.text_length import LONGEST_NAME
from workbench.model.yamlfile import standalone_text
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.resume import ChangedFilesError
from workbench.report.terminal_table import TerminalTable
from workbench.session.files import write_record
from workbench.session.index import IndexedSession, indexed_sessions
from workbench.session.journal import is_running, read_journal
from workbench.session.state import SessionStatus, effective

PASSED, FAILED, UNFINISHED = "passed", "FAILED", "unfinished"
RIGS = "rigs"
"""Folder of the sensors' rig files in the folder of sessions."""
SERIAL = re.compile(rf"[A-Za-z0-9][A-Za-z0-9_.-]{{0,{LONGEST_NAME - 1}}}")
"""Serial numbers; they are parts of file names."""
LONGEST_LINE = 1000
"""Largest number of characters of a line of input that are kept."""
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
            BadInputError: a file is wrong, or the folder of sessions cannot be used.
            StoppedError: the command was stopped; after a request during a session, that one has ended.
            AnswerNeededError: a prompt of the procedure needs a person.
            LaserOffNotConfirmedError: the beams may be on.
        """
        plan = Plan.load(self.rig, self.procedures)
        self._make_folders()
        try:
            while serial := self._next_serial(plan):
                # Counted again: another station may have worked in the meantime.
                self._calibrate(serial, self._tally(plan).of_serial(serial))
            print_message(f"line ended: {self._tally(plan).text}")
        except WorkbenchError as error:
            with suppress(BadInputError):  # the folder is gone; the error is the message
                error.add_note(self._tally(plan).text)
            raise

    def _make_folders(self) -> None:
        """Create the folders of sessions and rig files.

        Raises:
            BadInputError: a folder cannot be created.
        """
        for folder in (self.sessions, self.sessions / RIGS):
            try:
                folder.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise BadInputError(
                    f"{folder}: expected a folder for the sessions of the line, it cannot be created:"
                    f" {error.strerror}"
                ) from None

    def _next_serial(self, plan: Plan) -> str:
        """Serial number of the next sensor; empty if there is none. Shows the counters."""
        self._show(self._tally(plan))
        while serial := _ask_serial():
            if SERIAL.fullmatch(serial) and serial != UNKNOWN_SERIAL:
                break
            got = serial if len(serial) <= LONGEST_NAME else f"{serial[:LONGEST_NAME]}..."
            print_message(
                f"{got}: expected a serial number of letters, digits, _, . and -, at most {LONGEST_NAME}"
            )
        return serial

    def _calibrate(self, serial: str, last: Sensor | None) -> None:
        """Run a session of a sensor, or continue its last one; failures are printed.

        Raises:
            StoppedError: a stop was requested, at any time since the serial number was read.
        """
        if sys.stderr.isatty():
            Console(stderr=True).clear()
        stop = StopAfterCapture()
        try:
            session = self._run_session(serial, last, Screen(view=False, operator=self.operator, stop=stop))
            print_message(f"{certify(session)}: {session / DEFAULT_NAME}")
        except LimitFailedError:
            print_message(f"{serial} FAILED: no certificate")  # its verdict has been printed
        except ChangedFilesError as error:
            print_message("error: " + "\n".join(error.changes), red=True)
            print_message(f"{serial}: undo the changes, or run this command; then scan it again")
            command = ["workbench", "resume", str(error.session_dir), "--accept-changes", REASON_PLACEHOLDER]
            typer.echo(f"  {shlex.join(command)}", err=True)  # not wrapped: it is copied
        except (RigNotReadyError, BadInputError) as error:
            print_message(f"error: {error}", red=True)
            print_message(f"{serial}: scan it again to continue")
        finally:
            stop_at_once()  # the session has left its own handlers
        if stop.reason is not None:  # too late for the session
            raise StoppedError(stop.reason)

    def _run_session(self, serial: str, last: Sensor | None, screen: Screen) -> Path:
        """Folder of a session that has ended well: a new one, or the sensor's last one, continued.

        Raises:
            WorkbenchError: the session ended early, or is running in another program.
        """
        if last is not None and is_running(last.session):
            raise BadInputError(f"{last.session}: another program, such as another station, is running it")
        if last is not None and last.verdict == UNFINISHED:
            print_message(f"{serial}: its session {last.session.name} is continued")
            resume_session(last.session, None, screen)
            return last.session
        if last is not None and last.verdict == PASSED and not (last.session / DEFAULT_NAME).exists():
            return last.session  # it was killed before the certificate
        return run_procedures(list(self.procedures), self._rig_file(serial), self.sessions, screen)

    def _rig_file(self, serial: str) -> Path:
        """Rig file of a sensor, beside its sessions: a resumption reads it again.

        Raises:
            StoppedError: it cannot be written.
        """
        # A serial number alone may be the name of a file of a session.
        path = self.sessions / RIGS / f"rig-{serial}.yaml"
        write_record(path, rig_text_of(standalone_text(self.rig, Rig), serial).encode())
        return path

    def _tally(self, plan: Plan) -> Tally:
        """Sensors with a session of these procedures on this rig, in the order of their last sessions.

        Raises:
            BadInputError: the folder of sessions is missing.
        """
        names = tuple(one.procedure for one in plan.procedures)
        last: dict[str, IndexedSession] = {}
        sessions = sorted(indexed_sessions(self.sessions), key=_began_ns)
        for one in sessions:
            if (one.status.rig, one.status.procedures) == (plan.rig.rig, names):
                last.pop(one.serial, None)
                last[one.serial] = one
        damaged = sum(one.status.state == "damaged" for one in sessions)
        return Tally(tuple(Sensor.of(one) for one in last.values()), damaged)

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
    status: SessionStatus
    verdict: str
    """PASSED, FAILED or UNFINISHED."""

    @classmethod
    def of(cls, one: IndexedSession) -> Sensor:
        """The sensor of a session."""
        if one.status.state == "finished":
            verdict = PASSED
        else:
            verdict = FAILED if _is_decided(one.status.session_dir, one.records) else UNFINISHED
        return cls(one.serial, one.status, verdict)

    @property
    def session(self) -> Path:
        """Folder of the session."""
        return self.status.session_dir

    @property
    def result(self) -> str:
        """Outcome, or reason of a failure, in one line."""
        if self.verdict == PASSED:
            outcome = self.status.calibration or "; ".join(self.status.trials)
            return outcome.removeprefix("accepted: ")
        fit = refused_fit(self.session)
        return split_reason(self.status.why)[0] if fit is None else and_more(fit.reasons)


@dataclass(frozen=True)
class Tally:
    """Sensors of a line, counted."""

    sensors: tuple[Sensor, ...]
    """In the order of their last sessions."""
    damaged: int
    """Number of damaged sessions in the folder: it is not known whether they are of this line."""

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
        rest = f"; {counted(self.damaged, 'damaged session')} not counted" if self.damaged else ""
        every = counted(passed + failed, "sensor")
        return f"{every}: {passed} passed, {failed} failed{yield_text}{left}{rest}"

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


@lru_cache(maxsize=100_000)
def _is_decided(session_dir: Path, records: int) -> bool:
    """Whether a limit on the sensor ended a session: to continue it would give the same result.

    Args:
        session_dir: session.
        records: number of its records, by which a session that was continued differs.
    """
    try:
        events = [record.event for record in effective(read_journal(session_dir))]
    except BadInputError:  # damaged since it was indexed
        return True
    ends = [one for one in events if isinstance(one, ev.SessionFinished)]
    return bool(ends) and ends[-1].exit_code == LimitFailedError.exit_code


def _began_ns(one: IndexedSession) -> int:
    """Time at which a session began, ns since 1970 (UTC); names of folders have local time."""
    if one.first_record_ns:
        return one.first_record_ns
    try:
        return int(datetime.fromisoformat(one.began).timestamp() * 1e9)
    except ValueError:  # a damaged manifest
        return 0


def _ask_serial() -> str:
    """Serial number as scanned; empty at the end of the input. Input before the question is discarded."""
    is_terminal = sys.stdin.isatty()
    if is_terminal:
        termios.tcflush(sys.stdin, termios.TCIFLUSH)
    print_message("Scan or type the serial number of the next sensor; Enter alone ends.")
    print("> ", end="", file=sys.stderr, flush=True)
    try:
        # A signal that comes just before a read that blocks has no effect until the next input.
        while is_terminal and not select.select([sys.stdin], [], [], LOOK_S)[0]:
            pass
        line = part = sys.stdin.readline(LONGEST_LINE)
        while len(part) == LONGEST_LINE and not part.endswith("\n"):
            part = sys.stdin.readline(LONGEST_LINE)  # the rest of the line is discarded
        return printable(line.strip())
    except StoppedError:
        print(file=sys.stderr)
        raise
