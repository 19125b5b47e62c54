"""Repairs offered for a session with a refused calibration."""

from __future__ import annotations

import shlex
from pathlib import Path

from workbench.devices.protocols import Operator
from workbench.model import event as ev
from workbench.model.errors import AnswerNeededError, BadInputError, StoppedError
from workbench.model.prompt import Prompt
from workbench.procedure.engine.repair import Repair
from workbench.session.journal import read_journal
from workbench.session.state import effective

CONTRADICTION = "contradicts the other placements"
"""Reason in the commands that are printed."""


def refused_fit(session_dir: Path) -> ev.FitFinished | None:
    """Fit that ended a session because it was refused; None otherwise."""
    try:
        events = [r.event for r in effective(read_journal(session_dir))]
    except BadInputError:
        return None
    found = None
    for event in events:
        if isinstance(event, ev.FitFinished):
            found = event if event.verdict == "refused" else None
        elif isinstance(event, ev.StepFinished):  # the fit was accepted with a reason
            found = None
    return found


def suspects(fit: ev.FitFinished) -> list[str]:
    """Keys of the placements that a fit names as wrong, or else of those with an alarm."""
    named = [fault.placement for fault in fit.faults if fault.placement is not None]
    return list(dict.fromkeys(named)) or [one.placement for one in fit.left_out if one.alarm]


def repair_commands(session_dir: Path, fit: ev.FitFinished) -> list[str]:
    """Commands that repair a refused session.

    Args:
        session_dir: session.
        fit: its refused fit.
    """
    start, because = ["workbench", "repair", str(session_dir)], ["--reason", CONTRADICTION]
    commands = [
        [*start, *(word for key in suspects(fit) for word in (option, key)), *because]
        for option in ("--recapture", "--leave-out")
        if suspects(fit)
    ]
    if not commands and fit.left_out:
        # No evidence against it: it is offered to be captured again, never to be left out.
        worst = max(fit.left_out, key=lambda one: abs(one.z))
        commands.append([*start, "--recapture", worst.placement, "--reason", "largest residual, no alarm"])
    if (advised := _advised_mm(session_dir)) is not None:
        commands.append([*start, "--add", f"{advised:g}", "--reason", "the most informative standoff"])
    commands.append([*start, "--accept", "--reason", "the failed limit does not matter here"])
    return [shlex.join(command) for command in commands]


def _advised_mm(session_dir: Path) -> float | None:
    """Standoff that the session has advised last."""
    events = [r.event for r in effective(read_journal(session_dir))]
    advised = [event.next_standoff_mm for event in events if isinstance(event, ev.StandoffAdvised)]
    return advised[-1] if advised else None


def ask_for_repair(fit: ev.FitFinished, why: str, operator: Operator) -> Repair | None:
    """Repair that a person chooses at the bench; None without a suspect, a person or a wish.

    Args:
        fit: refused fit of the session.
        why: reason of the refusal.
        operator: person at the terminal.
    """
    keys = tuple(suspects(fit))
    if not keys:
        return None
    places = ", ".join(key.rpartition("/")[2] for key in keys)
    prompt = Prompt(
        key="repair",
        do=why[:1].upper() + why[1:],
        yes="end here; the session can be repaired later",
        may={"redo": f"capture {places} again now", "skip": f"leave {places} out"},
    )
    try:
        answer = operator.ask(prompt)
    except (AnswerNeededError, StoppedError):
        return None
    reason = answer.reason or CONTRADICTION
    match answer.action:
        case "redo":
            return Repair(reason, recapture=keys)
        case "skip":
            return Repair(reason, leave_out=keys)
        case _:
            return None
