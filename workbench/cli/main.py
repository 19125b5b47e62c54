"""The command line. Heavy libraries are imported inside the commands, so that `--help` answers at once."""

from __future__ import annotations

import gc
import os
import sys
import traceback
from pathlib import Path
from typing import Annotated

import typer

from workbench.cli.stopping import stop_at_once
from workbench.model.errors import WorkbenchError

app = typer.Typer(
    help="Calibration and lab-measurement workbench for laser-spot range sensors.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

INTERNAL_ERROR = 1
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


@app.command()
def run(
    procedures: Annotated[list[Path], typer.Argument(help="Procedure files, run in this order.")],
    rig: Annotated[Path, typer.Option(help="Rig file.")],
    sessions: Annotated[Path, typer.Option(help="Folder for the new session.")] = Path("sessions"),
) -> None:
    """Run procedures on a rig, in one session."""
    from workbench.cli.run import run_procedures

    run_procedures(procedures, rig, sessions)


@app.command()
def fit(
    source: Annotated[Path, typer.Argument(help="Captures file (CSV), or a session folder.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Calibration file to write (YAML).")],
    rig: Annotated[Path | None, typer.Option(help="Rig file; a session has its own.")] = None,
    accept: Annotated[
        str | None, typer.Option(metavar="REASON", help="Write it even if a limit fails, with this reason.")
    ] = None,
    without_standoff: Annotated[
        list[float] | None, typer.Option(metavar="MM", help="Leave this standoff out; may be repeated.")
    ] = None,
    fix: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Hold a parameter at the rig's value; repeatable."),
    ] = None,
    keep: Annotated[
        list[str] | None,
        typer.Option(metavar="TERM", help="Keep a term of the model whatever the data say; repeatable."),
    ] = None,
    json: Json = False,
) -> None:
    """Calibrate from a captures file or a session: images or pixel positions at known standoffs."""
    from workbench.cli.fit import Request, fit_captures

    request = Request(
        source, rig, output, accept, tuple(without_standoff or ()), tuple(fix or ()), tuple(keep or ())
    )
    fit_captures(request, json)


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
    captures: Annotated[Path, typer.Argument(help="Captures file (CSV).")],
    calibration: Annotated[Path, typer.Option(help="Calibration file (YAML).")],
    json: Json = False,
) -> None:
    """Range the scenes of a captures file with a calibration."""
    from workbench.cli.range import range_captures

    range_captures(captures, calibration, json)


@app.command()
def target(
    pdf: Annotated[Path, typer.Option(help="PDF file to write.")],
    rig: Annotated[Path | None, typer.Option(help="Rig file; its board, not the usual one.")] = None,
) -> None:
    """Print the board that calibrates the lens: a page of true size, with a ruler to check it."""
    from workbench.cli.target import write_target

    _say(write_target(pdf, rig))


@app.command()
def view(
    session: Annotated[Path, typer.Argument(help="Session folder.")],
) -> None:
    """Open a session's recording in the Rerun viewer."""
    from workbench.cli.view import view_session

    raise typer.Exit(view_session(session))


def main() -> None:
    """Entry point: every expected failure becomes a message and its exit code."""
    # Before numpy loads: for matrices as small as a fit's a second thread costs more than it gains.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Imports make 10^5 objects that stay; looking for garbage among them is a tenth of a short command.
    gc.set_threshold(100_000)
    stop_at_once()
    try:
        app()
    except WorkbenchError as error:
        _say(f"error: {error}")
        sys.exit(error.exit_code)
    except Exception:
        traceback.print_exc()
        _say("internal error: this is a defect of the workbench, please report it with the lines above")
        sys.exit(INTERNAL_ERROR)


def _say(message: str) -> None:
    typer.echo(message, err=True)
