"""Declarations of the commands on records: `report`, `export`, `history`, `use`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from workbench.cli.option_types import Json, OperatorName, Sessions, reason

Pdf = Annotated[Path | None, typer.Option(metavar="FILE", help="PDF file to write.")]
Serial = Annotated[str | None, typer.Option("--rig", metavar="SERIAL", help="Serial number of the sensor.")]
NO_QUESTIONS = "Do not ask for lab.yaml: what is missing is reported as not stated."


def report_(
    session: Annotated[
        Path | None, typer.Argument(help="Session folder or name.", show_default=False)
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", help="HTML file to write; by default in the session."),
    ] = None,
    pdf: Pdf = None,
    dcc: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Digital Calibration Certificate (XML) to write.")
    ] = None,
    sign: Annotated[
        Path | None, typer.Option(metavar="KEY", help="With --dcc: sign it with this private key (PEM).")
    ] = None,
    cert: Annotated[
        Path | None, typer.Option(metavar="CERT", help="X.509 certificate of that key (PEM).")
    ] = None,
    compare: Annotated[
        tuple[Path, Path] | None,
        typer.Option(metavar="A B", help="Instead: compare the calibrations of two sessions."),
    ] = None,
    sessions: Sessions = Path("sessions"),
    no_input: Annotated[bool, typer.Option("--no-input", help=NO_QUESTIONS)] = False,
    json: Json = False,
) -> None:
    """Write the certificate of a session. HTML, PDF, Digital Calibration Certificate."""
    from workbench.cli.report import Outputs, compare_sessions, report_session
    from workbench.report.certificate.signature import Signer

    if (session is None) == (compare is None):
        raise typer.BadParameter("expected either a session or --compare A B")
    if (sign is None) != (cert is None) or (sign is not None and dcc is None):
        raise typer.BadParameter("expected --sign KEY, --cert CERT and --dcc FILE together")
    signer = None if sign is None or cert is None else Signer.load(sign, cert)
    outputs = Outputs(output, pdf, dcc, json, signer)
    if compare is not None:
        compare_sessions(compare, sessions, outputs)
    elif session is not None:
        report_session(session, sessions, outputs, no_input)


def export(
    session: Annotated[Path, typer.Argument(help="Session folder or name.")],
    tables: Annotated[Path, typer.Option(metavar="DIR", help="New or empty folder for the tables.")],
    parquet: Annotated[bool, typer.Option("--parquet", help="Write Parquet files instead of CSV.")] = False,
    sessions: Sessions = Path("sessions"),
) -> None:
    """Export a session as tidy tables with a data dictionary."""
    from workbench.cli.export import export_tables

    export_tables(session, sessions, tables, parquet)


def history(
    rig: Serial = None,
    html: Annotated[Path | None, typer.Option(metavar="FILE", help="HTML page to write.")] = None,
    pdf: Pdf = None,
    note: Annotated[
        str | None,
        typer.Option(metavar="TEXT", callback=reason, help="Add a note to the record of a sensor (--rig)."),
    ] = None,
    operator: OperatorName = None,
    sessions: Sessions = Path("sessions"),
    json: Json = False,
) -> None:
    """Show control charts of a sensor. Its calibrations, verifications and drift."""
    from workbench.cli.history import HistoryRequest, show_history

    show_history(HistoryRequest(rig, html, pdf, note, operator, sessions), json)


def use(
    calibration: Annotated[Path, typer.Argument(help="Calibration file (YAML), or session folder or name.")],
    because: Annotated[
        str, typer.Option("--reason", metavar="TEXT", callback=reason, help="Reason, for the record.")
    ],
    rig: Annotated[str, typer.Option(metavar="SERIAL", help="Serial number of the sensor.")],
    operator: OperatorName = None,
    sessions: Sessions = Path("sessions"),
) -> None:
    """Put a calibration in force for a sensor. Also an earlier one; prints the change in mm."""
    from workbench.cli.use import Choice, put_in_force

    put_in_force(calibration, rig, Choice(because, operator), sessions)
