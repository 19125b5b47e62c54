"""Declarations of the commands on a bench beside `run`: `aim`, `line`, `lasers off`, `lasers state`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from workbench.cli.option_types import NoInput, OperatorName, millimetres

lasers = typer.Typer(help="Control a rig's lasers without a session.", no_args_is_help=True)


def aim(
    rig: Annotated[Path, typer.Option(help="Rig file.")],
    standoff: Annotated[
        float | None,
        typer.Option(
            metavar="MM",
            parser=millimetres(1),
            help="Standoff of the target; another one is typed while the command runs.",
        ),
    ] = None,
    calibration: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Compare with this calibration, not the rig file.")
    ] = None,
    no_input: NoInput = False,
    view: Annotated[bool, typer.Option("--view", help="Show the spots in the Rerun viewer.")] = False,
) -> None:
    """Aim and focus lasers, until Ctrl-C. Place, width, peak and direction of each spot."""
    from workbench.cli.aim import AimRequest, aim_lasers

    aim_lasers(AimRequest(rig, calibration, standoff, no_input, view))


def line(
    procedures: Annotated[list[Path], typer.Argument(help="Procedure files, run in this order.")],
    rig: Annotated[Path, typer.Option(help="Rig file; every sensor gets its own serial number.")],
    sessions: Annotated[Path, typer.Option(help="Folder for the sessions of the line.")] = Path("sessions"),
    operator: OperatorName = None,
) -> None:
    """Run procedures on one sensor after another. Serial number, session, certificate, next."""
    from workbench.cli.line import Line

    Line(tuple(procedures), rig, sessions, operator).run()


@lasers.command(name="off")
def lasers_off(rig: Annotated[Path, typer.Option(help="Rig file.")]) -> None:
    """Switch every laser off; exit code 7 if that is not confirmed."""
    from workbench.cli.lasers import lasers_off

    typer.echo(lasers_off(rig))


@lasers.command(name="state")
def lasers_state(rig: Annotated[Path, typer.Option(help="Rig file.")]) -> None:
    """Print the identity and interlock of the controller. Every laser is switched off."""
    from workbench.cli.lasers import lasers_state

    typer.echo(lasers_state(rig))
