"""Command line. Heavy libraries are imported inside the commands, so that `--help` is fast."""

from __future__ import annotations

import gc
import os
from datetime import date
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from workbench.cli.bench_commands import aim, lasers, line
from workbench.cli.console import print_message, print_warnings_as_notes
from workbench.cli.exit import exit_program, report
from workbench.cli.option_types import (
    AcceptChanges,
    AnswersFile,
    Details,
    FitVerdict,
    Json,
    NoInput,
    OperatorName,
    Sessions,
    View,
    day,
    millimetres,
    reason,
    whole,
)
from workbench.cli.record_commands import export, history, report_, use
from workbench.cli.repair import repair
from workbench.cli.stdio import accept_any_bytes, fill_closed_streams
from workbench.cli.stopping import ignore_signals, stop_at_once

app = typer.Typer(
    help="Calibration and lab-measurement workbench for laser-spot range sensors.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


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


ExistingCalibration = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Existing calibration of this rig, instead of a fit."),
]


@app.command()
def new(
    folder: Annotated[Path, typer.Argument(help="New or empty folder.")],
    no_input: Annotated[
        bool, typer.Option("--no-input", help="Do not ask: write procedures, example rigs, firmware alone.")
    ] = False,
) -> None:
    """Lay out a laboratory's folder, with the rig file of its sensor.

    At a terminal it asks about the sensor. Procedures, example rigs and firmware are copied.
    """
    from workbench.cli.dialogue import is_interactive
    from workbench.cli.new import lay_out

    print_message(lay_out(folder, ask=is_interactive() and not no_input))


@app.command()
def run(
    procedures: Annotated[list[Path], typer.Argument(help="Procedure files, run in this order.")],
    rig: Annotated[Path, typer.Option(help="Rig file.")],
    sessions: Annotated[Path, typer.Option(help="Folder for the new session.")] = Path("sessions"),
    calibration: ExistingCalibration = None,
    answers: AnswersFile = None,
    no_input: NoInput = False,
    view: View = None,
    details: Details = False,
    operator: OperatorName = None,
) -> None:
    """Run procedures on a rig in one session."""
    from workbench.cli.run import Screen, run_procedures

    screen = Screen(answers, no_input, view, details, operator)
    run_procedures(procedures, rig, sessions, screen, calibration)


@app.command()
def resume(
    session: Annotated[
        Path | None, typer.Argument(help="Session folder or name. Default: the last unfinished session.")
    ] = None,
    sessions: Sessions = Path("sessions"),
    accept_changes: AcceptChanges = None,
    answers: AnswersFile = None,
    no_input: NoInput = False,
    view: View = None,
    details: Details = False,
    operator: OperatorName = None,
) -> None:
    """Resume a session that ended early. Complete placements are not captured again."""
    from workbench.cli.run import Screen, resume_session
    from workbench.cli.sessions import find_session

    screen = Screen(answers, no_input, view, details, operator)
    resume_session(find_session(session, sessions), accept_changes, screen)


@app.command(name="sessions")
def sessions_(
    folder: Annotated[
        Path | None, typer.Argument(help="Folder of sessions, or one session. Default: as --sessions.")
    ] = None,
    sessions: Sessions = Path("sessions"),
    rig: Annotated[
        str | None, typer.Option(metavar="NAME", help="Sessions of this rig: name or serial number.")
    ] = None,
    since: Annotated[
        date | None, typer.Option(metavar="DATE", parser=day, help="Sessions from this day on: 2026-11-30.")
    ] = None,
    verdict: Annotated[
        FitVerdict | None, typer.Option(help="Sessions whose last fit has this verdict.")
    ] = None,
    json: Json = False,
) -> None:
    """List sessions with their states."""
    from workbench.cli.sessions import list_sessions
    from workbench.session.index import SessionSelection

    selection = SessionSelection(rig, since, None if verdict is None else verdict.value)
    list_sessions(sessions if folder is None else folder, json, selection)


@app.command()
def check(files: Annotated[list[Path], typer.Argument(help="Procedure and rig files.")]) -> None:
    """Check procedure and rig files. Mistakes are printed with file and line."""
    from workbench.cli.check import check_files

    check_files(files)


@app.command()
def plan(
    procedures: Annotated[list[Path], typer.Argument(help="Procedure files, in the order of `run`.")],
    rig: Annotated[Path, typer.Option(help="Rig file.")],
    sessions: Sessions = Path("sessions"),
    calibration: ExistingCalibration = None,
) -> None:
    """Print the steps of procedures. With captures, laser emission and duration."""
    from workbench.cli.plan import print_plan

    print_plan(procedures, rig, sessions, calibration)


@app.command()
def doctor(
    rig: Annotated[Path, typer.Argument(help="Rig file.")],
    no_input: NoInput = False,
) -> None:
    """Check every part of a rig.

    Controller, interlock, camera, latency, exposure and each laser; a part that fails does not end the check.
    """
    from workbench.cli.doctor import examine_rig

    examine_rig(rig, no_input)


@app.command()
def fit(
    source: Annotated[Path, typer.Argument(help="Captures file (CSV), or a session folder.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Calibration file to write (YAML).")],
    rig: Annotated[Path | None, typer.Option(help="Rig file. Default: that of the session.")] = None,
    accept: Annotated[
        str | None,
        typer.Option(
            metavar="REASON", callback=reason, help="Reason to write the file even if a limit fails."
        ),
    ] = None,
    without_standoff: Annotated[
        list[float] | None,
        typer.Option(metavar="MM", parser=millimetres(0), help="Exclude this standoff; repeatable."),
    ] = None,
    fix: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Fix a parameter at the rig file's value; repeatable."),
    ] = None,
    recording: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Recording of the fit to write, for `workbench view`.")
    ] = None,
    json: Json = False,
    details: Details = False,
) -> None:
    """Fit a calibration to images or positions at known standoffs."""
    gc.set_threshold(1_000_000)  # more objects than a fit creates: collection would only take time
    from workbench.cli.fit import Request, fit_captures

    without, fixed = tuple(without_standoff or ()), tuple(fix or ())
    request = Request(source, rig, output, accept, without, fixed, recording)
    fit_captures(request, json, details)
    exit_program(0, at_once=True)


@app.command()
def design(
    rig: Annotated[Path, typer.Option(help="Rig file.")],
    standoffs: Annotated[
        str | None, typer.Option(metavar="MM,MM,...", help="Standoffs. Default: propose the best ones.")
    ] = None,
    count: Annotated[
        int | None,
        typer.Option(metavar="N", parser=whole, help="Number of standoffs to propose. Default: 11."),
    ] = None,
    repeats: Annotated[
        int, typer.Option(metavar="N", parser=whole, help="Captures of each laser at each standoff.")
    ] = 10,
    json: Json = False,
) -> None:
    """Forecast the uncertainty of a calibration. Without data; proposes standoffs."""
    from workbench.cli.design import design_calibration

    design_calibration(rig, standoffs, count, repeats, json)


@app.command()
def compare(
    a: Annotated[Path, typer.Argument(help="Calibration file (YAML).")],
    b: Annotated[Path, typer.Argument(help="Another calibration file of the same sensor.")],
    json: Json = False,
) -> None:
    """Test whether two calibrations agree. Names what changed."""
    from workbench.cli.compare import compare_calibrations

    compare_calibrations(a, b, json)


@app.command(name="range")
def range_(
    calibration: Annotated[Path, typer.Option(help="Calibration file (YAML).")],
    captures: Annotated[Path | None, typer.Argument(help="Captures file (CSV) or session folder.")] = None,
    rig: Annotated[Path | None, typer.Option(help="Rig file, for live ranging on its bench.")] = None,
    readings: Annotated[
        int | None,
        typer.Option(metavar="N", parser=whole, help="Live: number of readings. Default: until Ctrl-C."),
    ] = None,
    standoff: Annotated[
        float | None,
        typer.Option(metavar="MM", parser=millimetres(1), help="Live: place the bench's target there."),
    ] = None,
    stats: Annotated[bool, typer.Option("--stats", help="Live: print the latency at the end.")] = False,
    view: Annotated[bool, typer.Option("--view", help="Live: show readings in the Rerun viewer.")] = False,
    json: Json = False,
) -> None:
    """Range the scenes of a captures file, or live on a bench."""
    if (captures is None) == (rig is None):
        raise typer.BadParameter("expected either a captures file or --rig for live ranging")
    if captures is not None:
        if readings is not None or standoff is not None or stats or view:
            raise typer.BadParameter(
                "--readings, --standoff, --stats and --view require --rig (live ranging)"
            )
        gc.set_threshold(1_000_000)  # as for `fit`: readings are kept
        from workbench.cli.range import range_captures

        range_captures(captures, calibration, json)
    if rig is not None:
        from workbench.cli.live import LiveRequest, range_live

        range_live(LiveRequest(rig, calibration, readings, standoff, stats, view), json)


@app.command()
def campaign(
    file: Annotated[Path, typer.Argument(metavar="CAMPAIGN", help="Campaign file (YAML).")],
    output: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="FOLDER", help="Folder of the results; also one to continue."),
    ],
    workers: Annotated[
        int | None,
        typer.Option(metavar="N", parser=whole, help="Worker processes. Default: one for each core."),
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Dask scheduler whose workers do the work.")
    ] = None,
    json: Json = False,
) -> None:
    """Run a campaign on many sensors or sessions. On all cores, or on a cluster.

    A campaign that was stopped continues with the same command; finished chunks are kept.
    """
    if workers is not None and scheduler is not None:
        raise typer.BadParameter("expected either --workers or --scheduler")
    from workbench.cli.campaign import CampaignRequest, run_campaign

    run_campaign(CampaignRequest(file, output, workers, scheduler), json)


class TrialKind(StrEnum):
    """Kinds of statistics of `workbench trial`."""

    ACCURACY = "accuracy"
    REPEATABILITY = "repeatability"
    GAUGE_RR = "gauge-rr"
    LINEARITY = "linearity"


@app.command()
def trial(
    kind: Annotated[TrialKind, typer.Argument(help="Statistics to compute.")],
    readings: Annotated[
        list[Path],
        typer.Argument(
            help="Readings (CSV): true_mm, measured_mm; also placement, repeat, session. A file is a session."
        ),
    ],
    json: Json = False,
) -> None:
    """Compute statistics of a trial of any range sensor. From files of readings."""
    from workbench.cli.trial import analyse_readings

    analyse_readings(kind.value, readings, json)


@app.command()
def target(
    pdf: Annotated[Path, typer.Option(help="PDF file to write.")],
    rig: Annotated[Path | None, typer.Option(help="Rig file with the board. Default: the A4 board.")] = None,
) -> None:
    """Write the page of the printed board that calibrates the lens."""
    from workbench.cli.target import write_target

    print_message(write_target(pdf, rig))


@app.command()
def view(
    what: Annotated[
        list[Path],
        typer.Argument(
            help="One or two sessions or captures files; or one calibration or recording (.rrd).",
            show_default=False,
        ),
    ],
    sessions: Sessions = Path("sessions"),
    rig: Annotated[Path | None, typer.Option(help="Rig file of a captures file.")] = None,
    without_standoff: Annotated[
        list[float] | None,
        typer.Option(metavar="MM", parser=millimetres(0), help="Beside it, a fit without this standoff."),
    ] = None,
    rebuild: Annotated[
        bool, typer.Option("--rebuild", help="Make the recording again from frames and journal.")
    ] = False,
    web: Annotated[bool, typer.Option("--web", help="In a browser on this computer.")] = False,
) -> None:
    """Replay in the Rerun viewer: frames, spots, residuals and trials."""
    from workbench.cli.view import Request, view

    asked = Request(tuple(what), sessions, rig, tuple(without_standoff or ()), rebuild, web)
    raise typer.Exit(view(asked))


for other in (aim, line, repair, export, history, use):
    app.command()(other)
app.command(name="report")(report_)
app.add_typer(lasers, name="lasers")


def main() -> None:
    """Entry point of the command line: turns every expected error into a message and its exit code."""
    # Before numpy loads: for the small matrices of a fit a second thread costs more than it gains.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    fill_closed_streams()
    accept_any_bytes()
    stop_at_once()
    print_warnings_as_notes()
    try:
        app()
    except (Exception, SystemExit) as error:
        ignore_signals()  # a further signal must not replace the message
        exit_program(report(error))
