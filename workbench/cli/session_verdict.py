"""Verdict of a session that has ended, from its journal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from workbench.cli.brief_notes import brief_notes, merge_equal_kinds
from workbench.cli.refusal import failed_limit_commands, refused_fit, repair_commands
from workbench.cli.verdict import Verdict, and_more, split_reason
from workbench.model import event as ev
from workbench.model.errors import LimitFailedError
from workbench.model.fit_event import FitFinished
from workbench.model.number_text import counted
from workbench.session.journal import read_journal
from workbench.session.state import effective

REPEAT = "remove the cause, and capture this placement again"
"""Action after a limit on captures."""
CALIBRATE_AGAIN = "see the readings in the recording; if the target was right, calibrate again"
"""Action after a failed limit on the results of a trial."""


def session_verdict(session_dir: Path, refused: LimitFailedError | None) -> Verdict:
    """Verdict of an ended session.

    Args:
        session_dir: session.
        refused: error of the limit that ended the session; None where it is finished.
    """
    events = [record.event for record in effective(read_journal(session_dir))]
    fits = [event for event in events if isinstance(event, FitFinished)]
    notes = fit_notes(fits[-1]) if fits else []
    if refused is None:
        return _finished(session_dir, events, notes)
    if (fit := refused_fit(session_dir)) is not None:
        return _refused_calibration(session_dir, fit, notes)
    return _failed_limit(session_dir, events, notes, str(refused))


def fit_notes(fit: FitFinished) -> list[str]:
    """Warnings and rejected captures of a fit in brief."""
    rejected = merge_equal_kinds(dict.fromkeys(one.reason for one in fit.rejected))
    return [*brief_notes(fit.warnings), *(f"not used: {line}" for line in rejected)]


def _finished(session_dir: Path, events: Sequence[ev.Event], notes: Sequence[str]) -> Verdict:
    lines = _outcomes(events)
    decided = any(isinstance(event, FitFinished | ev.LimitChecked) for event in events)
    headline, *facts = lines or [counted(sum(isinstance(e, ev.CaptureTaken) for e in events), "capture")]
    return Verdict(
        word="ACCEPTED" if decided else "DONE",
        headline=headline,
        facts=facts,
        notes=notes,
        labelled=[*_files(session_dir, events), *_where(session_dir)],
    )


def _refused_calibration(session_dir: Path, fit: FitFinished, notes: Sequence[str]) -> Verdict:
    _, remedy = split_reason(fit.reasons[0])
    # The commands say the same as the remedy of a wrong placement, and name the session.
    return Verdict(
        word="REFUSED",
        headline=and_more(fit.reasons),
        action="" if fit.suspects else remedy,
        commands=repair_commands(session_dir, fit),
        notes=notes,
        labelled=_where(session_dir),
    )


def _failed_limit(session_dir: Path, events: Sequence[ev.Event], notes: Sequence[str], why: str) -> Verdict:
    """Verdict where a limit on captures or on a trial's result failed."""
    cause, remedy = split_reason(why)
    commands = failed_limit_commands(session_dir, events)
    unfinished = bool(commands) and commands[0][1] == "resume"
    return Verdict(
        word="REFUSED",
        headline=cause,
        action=remedy or (REPEAT if unfinished else CALIBRATE_AGAIN),
        commands=commands,
        facts=_outcomes(events),
        notes=notes,
        labelled=_where(session_dir),
    )


def _outcomes(events: Sequence[ev.Event]) -> list[str]:
    """Outcomes of the fits and trials in one line each, with the name of the procedure."""
    found: list[str] = []
    has_result = False
    for event in events:
        if isinstance(event, FitFinished | ev.TrialFinished):
            has_result = True
        elif isinstance(event, ev.StepFinished) and has_result:
            found.append(f"{event.procedure}: {event.outcome.removeprefix('accepted: ')}")
            has_result = False
    return found


def _files(session_dir: Path, events: Sequence[ev.Event]) -> list[tuple[str, str]]:
    exported = dict.fromkeys(event.path for event in events if isinstance(event, ev.CalibrationExported))
    return [("file:", f"{session_dir / path} written") for path in exported]


def _where(session_dir: Path) -> list[tuple[str, str]]:
    return [("session:", str(session_dir)), ("replay:", f"workbench view {session_dir}")]
