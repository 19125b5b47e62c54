"""Commands offered for a session in which a calibration was refused, or a limit failed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import hypot, inf
from pathlib import Path

from workbench.cli.option_types import REASON_PLACEHOLDER
from workbench.devices.protocols import Operator
from workbench.model import event as ev
from workbench.model.errors import AnswerNeededError, BadInputError, StoppedError
from workbench.model.prompt import Action, Prompt
from workbench.procedure.engine.repair import Repair, skipped_placements
from workbench.session.journal import read_journal
from workbench.session.repairs import repairs_of
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


def repair_commands(session_dir: Path, fit: ev.FitFinished) -> list[list[str]]:
    """Commands that repair a refused session, as lists of words, the recommended one first.

    None for a named fault of no single placement, such as exchanged lasers: no repair of placements cures it.

    Args:
        session_dir: session.
        fit: its refused fit.
    """
    commands = list(_placement_decisions(session_dir, fit))
    if not fit.has_named_fault:
        commands.append(["--accept", "--reason", REASON_PLACEHOLDER])
    return [["workbench", "repair", str(session_dir), *words] for words in commands]


def _placement_decisions(session_dir: Path, fit: ev.FitFinished) -> Iterator[list[str]]:
    """Options of `repair` that may cure the cause of the refusal."""
    if fit.suspects:
        for option in ("--recapture", "--leave-out"):
            yield [*_each(option, fit.suspects), "--reason", CONTRADICTION]
    elif fit.needs_standoffs:
        if skipped := _not_used(session_dir, fit):
            yield [*_each("--restore", skipped), "--reason", "the fit needs more standoffs"]
        if (advised := _advised_mm(session_dir)) is not None:
            yield ["--add", f"{advised:g}", "--reason", "the most informative standoff"]
    elif (worst := _worst(fit)) is not None:
        yield ["--recapture", worst, "--reason", "largest residual, no alarm"]


def failed_limit_commands(session_dir: Path, events: Sequence[ev.Event]) -> list[list[str]]:
    """Commands that continue a session after a failed limit on captures, or on the results of a trial.

    A resumption captures an unfinished placement again. With all placements complete it would compute the
    same results: the placement with the largest error has to be captured again.

    Args:
        session_dir: session.
        events: its valid events.
    """
    began = max((n for n, event in enumerate(events) if isinstance(event, ev.StepStarted)), default=0)
    step = events[began:]
    placed = [event for event in step if isinstance(event, ev.TargetPlaced | ev.PlacementFinished)]
    if placed and isinstance(placed[-1], ev.PlacementFinished):
        decision = ["--recapture", _largest_error(step) or placed[-1].key]
    elif not placed and (skipped := skipped_placements(step)):
        decision = _each("--restore", skipped)
    else:
        return [["workbench", "resume", str(session_dir)]] if placed else []
    return [["workbench", "repair", str(session_dir), *decision, "--reason", REASON_PLACEHOLDER]]


def _largest_error(step: Sequence[ev.Event]) -> str | None:
    """Key of the placement with a trial's largest error in standard deviations; None without readings."""
    sizes: dict[str, float] = {}
    key = ""
    for event in step:
        if isinstance(event, ev.TargetPlaced):
            key = event.placement.key
        elif isinstance(event, ev.ReadingTaken):
            sizes[key] = max(sizes.get(key, 0.0), _size(event))
    return max(sizes, key=lambda one: sizes[one]) if sizes else None


def _size(reading: ev.ReadingTaken) -> float:
    """Magnitude of a reading's error in standard deviations; infinite without a range."""
    if reading.error_mm is None or not reading.sigma_mm:
        return inf
    return abs(reading.error_mm) / hypot(reading.sigma_mm, reading.reference_sd_mm or 0.0)


def _each(option: str, keys: Sequence[str]) -> list[str]:
    return [word for key in keys for word in (option, key)]


def _not_used(session_dir: Path, fit: ev.FitFinished) -> list[str]:
    """Keys of the placements before the fit that were skipped or left out."""
    records = effective(read_journal(session_dir))
    events = [r.event for r in records]
    used = {one.placement for one in fit.residuals}
    out = (*repairs_of(records).left_out, *skipped_placements(events[: events.index(fit)]))
    return [key for key in dict.fromkeys(out) if key not in used]


def _worst(fit: ev.FitFinished) -> str | None:
    """Key of the placement with the largest error of the cross-validation; None where it is not to blame.

    There is no evidence against it: it is offered to be captured again, never to be left out.
    """
    if fit.has_named_fault or fit.needs_standoffs or not fit.left_out:
        return None
    return max(fit.left_out, key=lambda one: abs(one.z)).placement


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
    named, worst = fit.suspects, _worst(fit)
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
