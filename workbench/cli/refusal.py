"""Repairs offered for a session with a refused calibration."""

from __future__ import annotations

from pathlib import Path

from workbench.devices.protocols import Operator
from workbench.model import event as ev
from workbench.model.errors import AnswerNeededError, BadInputError, StoppedError
from workbench.model.prompt import Action, Prompt
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


def repair_commands(session_dir: Path, fit: ev.FitFinished) -> list[list[str]]:
    """Commands that repair a refused session, as lists of words, the recommended one first.

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
    if not commands and (worst := _worst(fit)) is not None:
        commands.append([*start, "--recapture", worst, "--reason", "largest residual, no alarm"])
    if (advised := _advised_mm(session_dir)) is not None:
        commands.append([*start, "--add", f"{advised:g}", "--reason", "the most informative standoff"])
    commands.append([*start, "--accept", "--reason", "the failed limit does not matter here"])
    return commands


def _worst(fit: ev.FitFinished) -> str | None:
    """Key of the placement with the largest error of the cross-validation.

    There is no evidence against it: it is offered to be captured again, never to be left out.
    """
    return max(fit.left_out, key=lambda one: abs(one.z)).placement if fit.left_out else None


def _advised_mm(session_dir: Path) -> float | None:
    """Standoff that the session has advised last."""
    events = [r.event for r in effective(read_journal(session_dir))]
    advised = [event.next_standoff_mm for event in events if isinstance(event, ev.StandoffAdvised)]
    return advised[-1] if advised else None


def ask_for_repair(fit: ev.FitFinished, operator: Operator) -> Repair | None:
    """Repair that a person chooses at the bench; None without a placement, a person or a wish.

    Args:
        fit: refused fit of the session.
        operator: person at the terminal.
    """
    named, worst = tuple(suspects(fit)), _worst(fit)
    keys = named or ((worst,) if worst is not None else ())
    if not keys:
        return None
    places = ", ".join(key.rpartition("/")[2].replace("mm", " mm") for key in keys)
    may: dict[Action, str] = {"redo": f"capture {places} again now"}
    if named:
        may["skip"] = f"leave {places} out"
    prompt = Prompt(
        key="repair",
        do="End the session here, with its calibration refused?",
        yes="end; it can be repaired later",
        may=may,
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
