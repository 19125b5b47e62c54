"""The command line. Heavy libraries are imported inside the commands, so that `--help` answers at once."""

from __future__ import annotations

import errno
import gc
import os
import traceback
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from workbench.cli.console import say
from workbench.cli.exit import exit_program
from workbench.cli.option_types import millimetres, whole
from workbench.cli.stdio import fill_closed_streams
from workbench.cli.stopping import ignore_signals, stop_at_once
from workbench.model.errors import LaserOffNotConfirmedError, StoppedError, WorkbenchError

app = typer.Typer(
    help="Calibration and lab-measurement workbench for laser-spot range sensors.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

lasers = typer.Typer(help="The rig's lasers, without a session.", no_args_is_help=True)
app.add_typer(lasers, name="lasers")

INTERNAL_ERROR = 1
NO_MORE_WRITTEN = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO}
"""A disk, a quota or a largest file is full, or a device fails or is gone."""
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON on standard output.")]


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(version("laser-range-workbench"))
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Calibration and lab-measurement workbench for laser-spot range sensors."""


AnswersFile = Annotated[
    Path | None, typer.Option(help="Answers to prompts (YAML); not to those that need eyes at the bench.")
]
NoInput = Annotated[
    bool, typer.Option("--no-input", help="Ask nobody: an open prompt ends with exit code 6.")
]


@app.command()
def new(folder: Annotated[Path, typer.Argument(help="New or empty folder.")]) -> None:
    """Lay out a laboratory's own folder: procedures, rigs, firmware."""
    from workbench.cli.new import lay_out

    say(lay_out(folder))


@app.command()
def run(
    procedures: Annotated[list[Path], typer.Argument(help="Procedure files, run in this order.")],
    rig: Annotated[Path, typer.Option(help="Rig file.")],
    sessions: Annotated[Path, typer.Option(help="Folder for the new session.")] = Path("sessions"),
    answers: AnswersFile = None,
    no_input: NoInput = False,
) -> None:
    """Run procedures on a rig, in one session."""
    from workbench.cli.run import Answers, run_procedures

    run_procedures(procedures, rig, sessions, Answers(answers, no_input))


Sessions = Annotated[Path, typer.Option(help="Folder of sessions.")]


def _reason(given: str | None) -> str | None:
    if given is not None and not given.strip():
        raise typer.BadParameter("expected a reason in words, got a blank")
    return given


@app.command()
def resume(
    session: Annotated[
        Path | None, typer.Argument(help="Session, by folder or name; the last unfinished one if not given.")
    ] = None,
    sessions: Sessions = Path("sessions"),
    accept_changes: Annotated[
        str | None,
        typer.Option(
            metavar="REASON", callback=_reason, help="Go on although rig, procedure or versions changed."
        ),
    ] = None,
    answers: AnswersFile = None,
    no_input: NoInput = False,
) -> None:
    """Go on with a session that ended early: nothing that is whole is captured again."""
    from workbench.cli.run import Answers, resume_session
    from workbench.cli.sessions import find_session

    resume_session(find_session(session, sessions), accept_changes, Answers(answers, no_input))


@app.command(name="sessions")
def sessions_(sessions: Sessions = Path("sessions"), json: Json = False) -> None:
    """List sessions: finished, waiting for an answer, stopped, failed, and how to go on."""
    from workbench.cli.sessions import list_sessions

    list_sessions(sessions, json)


@app.command()
def check(files: Annotated[list[Path], typer.Argument(help="Procedure and rig files.")]) -> None:
    """Look through procedure and rig files: what is wrong is named with file and line."""
    from workbench.cli.plan import check_files

    check_files(files)


@app.command()
def plan(
    procedures: Annotated[list[Path], typer.Argument(help="Procedure files, in the order of `run`.")],
    rig: Annotated[Path, typer.Option(help="Rig file.")],
    sessions: Sessions = Path("sessions"),
) -> None:
    """Print every step, the number of shots, seconds of emission, and the time it will take."""
    from workbench.cli.plan import print_plan

    print_plan(procedures, rig, sessions)


@app.command()
def doctor(
    rig: Annotated[Path, typer.Argument(help="Rig file.")],
    no_input: NoInput = False,
) -> None:
    """Try a rig: camera, controller, interlock, each laser seen, exposure, latency."""
    from workbench.cli.doctor import examine_rig

    examine_rig(rig, no_input)


@app.command()
def fit(
    source: Annotated[Path, typer.Argument(help="Captures file (CSV), or a session folder.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Calibration file to write (YAML).")],
    rig: Annotated[Path | None, typer.Option(help="Rig file; a session has its own.")] = None,
    accept: Annotated[
        str | None,
        typer.Option(
            metavar="REASON", callback=_reason, help="Write it even if a limit fails, with this reason."
        ),
    ] = None,
    without_standoff: Annotated[
        list[float] | None,
        typer.Option(metavar="MM", parser=millimetres(0), help="Leave this standoff out; may be repeated."),
    ] = None,
    fix: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Hold a parameter at the rig's value; repeatable."),
    ] = None,
    json: Json = False,
) -> None:
    """Calibrate from a captures file or a session: images or pixel positions at known standoffs."""
    gc.set_threshold(1_000_000)  # more than a fit makes: it ends after a second, and its garbage with it
    from workbench.cli.fit import Request, fit_captures

    request = Request(source, rig, output, accept, tuple(without_standoff or ()), tuple(fix or ()))
    fit_captures(request, json)
    exit_program(0, at_once=True)


@app.command()
def design(
    rig: Annotated[Path, typer.Option(help="Rig file.")],
    standoffs: Annotated[
        str | None, typer.Option(metavar="MM,MM,...", help="Without them the best ones are proposed.")
    ] = None,
    count: Annotated[
        int | None, typer.Option(metavar="N", parser=whole, help="How many to propose (11).")
    ] = None,
    repeats: Annotated[
        int, typer.Option(metavar="N", parser=whole, help="Readings of each laser at each standoff.")
    ] = 10,
    json: Json = False,
) -> None:
    """Predict, before any data, what a calibration will determine; propose standoffs."""
    from workbench.cli.design import design_calibration

    design_calibration(rig, standoffs, count, repeats, json)


@app.command()
def compare(
    a: Annotated[Path, typer.Argument(help="Calibration file (YAML).")],
    b: Annotated[Path, typer.Argument(help="Another of the same sensor.")],
    json: Json = False,
) -> None:
    """Tell whether two calibrations give the same ranges, and what moved if not."""
    from workbench.cli.compare import compare_calibrations

    compare_calibrations(a, b, json)


@app.command(name="range")
def range_(
    calibration: Annotated[Path, typer.Option(help="Calibration file (YAML).")],
    captures: Annotated[Path | None, typer.Argument(help="Captures file (CSV), or a session.")] = None,
    rig: Annotated[Path | None, typer.Option(help="Rig file: range live on its bench instead.")] = None,
    readings: Annotated[
        int | None,
        typer.Option(metavar="N", parser=whole, help="Live: stop after so many; else by a signal (Ctrl-C)."),
    ] = None,
    standoff: Annotated[
        float | None,
        typer.Option(metavar="MM", parser=millimetres(1), help="Live: have the bench's target placed there."),
    ] = None,
    stats: Annotated[bool, typer.Option("--stats", help="Live: print the latency at the end.")] = False,
    json: Json = False,
) -> None:
    """Range the scenes of a captures file, or live on a rig's bench, with a calibration."""
    if (captures is None) == (rig is None):
        raise typer.BadParameter("expected either a captures file, or --rig for live ranging")
    if captures is not None:
        if readings is not None or standoff is not None or stats:
            raise typer.BadParameter("--readings, --standoff and --stats are for live ranging, with --rig")
        from workbench.cli.range import range_captures

        range_captures(captures, calibration, json)
    if rig is not None:
        from workbench.cli.live import LiveRequest, range_live

        range_live(LiveRequest(rig, calibration, readings, standoff, stats), json)


@app.command()
def target(
    pdf: Annotated[Path, typer.Option(help="PDF file to write.")],
    rig: Annotated[Path | None, typer.Option(help="Rig file; its board, not the usual one.")] = None,
) -> None:
    """Print the board that calibrates the lens: a page of true size, with a ruler to check it."""
    from workbench.cli.target import write_target

    say(write_target(pdf, rig))


@app.command()
def view(
    session: Annotated[Path, typer.Argument(help="Session folder.")],
) -> None:
    """Open a session's recording in the Rerun viewer."""
    from workbench.cli.view import view_session

    raise typer.Exit(view_session(session))


@lasers.command(name="off")
def lasers_off(rig: Annotated[Path, typer.Option(help="Rig file.")]) -> None:
    """Put every laser off; exit 7 if nobody confirms it."""
    from workbench.cli.lasers import lasers_off

    typer.echo(lasers_off(rig))


@lasers.command(name="state")
def lasers_state(rig: Annotated[Path, typer.Option(help="Rig file.")]) -> None:
    """Tell who the controller is, and its interlock. Opening its port puts every laser off."""
    from workbench.cli.lasers import lasers_state

    typer.echo(lasers_state(rig))


def main() -> None:
    """Entry point: every expected failure becomes a message and its exit code."""
    # Before numpy loads: for matrices as small as a fit's a second thread costs more than it gains.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    fill_closed_streams()
    stop_at_once()
    try:
        app()
    except (Exception, SystemExit) as error:
        ignore_signals()  # one more must not take the place of what is told now
        exit_program(_tell(error))


def _tell(error: BaseException) -> int:
    """Say why the command ends; returns its exit code."""
    chain = _chain(error)
    if unsafe := [e for e in chain if isinstance(e, LaserOffNotConfirmedError)]:
        say(f"error: {unsafe[0]}", red=True)  # whatever came on top of it: a stop, a full disk
        return LaserOffNotConfirmedError.exit_code
    if isinstance(error, SystemExit):
        if any(isinstance(e, BrokenPipeError) for e in chain):  # as with `| head`; typer has made a 1 of it
            return StoppedError.exit_code
        return error.code if isinstance(error.code, int) else int(error.code is not None)
    if isinstance(error, WorkbenchError):
        say(f"error: {error}")
        return error.exit_code
    if isinstance(error, OSError) and error.errno in NO_MORE_WRITTEN:
        say(f"error: {error.filename or 'what is printed, or a file'}: cannot be written: {error.strerror}")
        return StoppedError.exit_code
    with suppress(OSError):
        traceback.print_exception(error)
    say("internal error: this is a defect of the workbench, please report it with the lines above")
    return INTERNAL_ERROR


def _chain(error: BaseException) -> list[BaseException]:
    """The error and all that it came from, or came on top of."""
    found: list[BaseException] = []
    ahead: list[BaseException | None] = [error]
    while ahead:
        each = ahead.pop()
        if each is not None and each not in found:
            found.append(each)
            ahead += [each.__context__, each.__cause__]
    return found
