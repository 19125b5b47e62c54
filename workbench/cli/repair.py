"""`workbench repair`: decisions about the placements of a session that has ended."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from workbench.cli.option_types import (
    AcceptChanges,
    AnswersFile,
    Details,
    NoInput,
    OperatorName,
    Sessions,
    View,
    millimetres,
    reason,
)


def repair(
    session: Annotated[Path, typer.Argument(help="Session folder or name; also a finished or refused one.")],
    because: Annotated[
        str, typer.Option("--reason", metavar="TEXT", callback=reason, help="Reason, for the record.")
    ],
    recapture: Annotated[
        list[str] | None,
        typer.Option(metavar="PLACEMENT", help="Capture this placement (mm, or key) again; repeatable."),
    ] = None,
    leave_out: Annotated[
        list[str] | None,
        typer.Option(metavar="PLACEMENT", help="Do not use this placement; repeatable."),
    ] = None,
    restore: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PLACEMENT",
            help="Undo --leave-out, --recapture or a skip; repeatable.",
        ),
    ] = None,
    add: Annotated[
        list[float] | None,
        typer.Option(
            metavar="MM", parser=millimetres(0.001), help="Capture at this standoff too; repeatable."
        ),
    ] = None,
    accept: Annotated[
        bool, typer.Option("--accept", help="Accept a calibration that fails its limits.")
    ] = False,
    accept_changes: AcceptChanges = None,
    sessions: Sessions = Path("sessions"),
    answers: AnswersFile = None,
    no_input: NoInput = False,
    view: View = None,
    details: Details = False,
    operator: OperatorName = None,
) -> None:
    """Repair an ended session. Captures placements again, leaves them out, restores or adds them."""
    from workbench.cli.run import Screen, resume_session
    from workbench.cli.sessions import find_session
    from workbench.procedure.engine.repair import Repair

    decisions = Repair(
        reason=because,
        recapture=tuple(recapture or ()),
        leave_out=tuple(leave_out or ()),
        restore=tuple(restore or ()),
        add_mm=tuple(add or ()),
        accept=accept,
    )
    folder = find_session(session, sessions)
    screen = Screen(answers, no_input, view, details, operator)
    resume_session(folder, accept_changes, screen, decisions)
