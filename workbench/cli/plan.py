"""`workbench check` and `workbench plan`: what will happen, before anybody stands at the bench."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console
from rich.table import Table

from workbench.model.errors import BadInputError
from workbench.procedure.capture.exposure import LIT_FRAMES, MOST_TRIALS
from workbench.procedure.capture.latency import LEASE_S
from workbench.procedure.engine.check import check_file
from workbench.procedure.engine.durations import StepDurations, learn_durations
from workbench.procedure.engine.plan import Plan, PlannedStep


def check_files(files: list[Path]) -> None:
    """Print what is wrong with each file, and what is worth knowing.

    Raises:
        BadInputError: one of them is wrong.
    """
    console = Console(stderr=True, highlight=False, soft_wrap=True, markup=False)
    wrong = []
    for path in files:
        try:
            notes = check_file(path)
        except BadInputError as error:
            wrong.append(str(error))
            continue
        for note in notes:
            console.print(f"note: {note}")
        console.print(f"{path}: good")
    if wrong:
        raise BadInputError("\n".join(wrong))


def print_plan(procedures: list[Path], rig_path: Path, sessions: Path) -> None:
    """Print every step, its shots, their emission, and the time it will take.

    Raises:
        BadInputError: a file is wrong.
    """
    plan = Plan.load(rig_path, procedures)
    if sessions.exists() and not sessions.is_dir():
        raise BadInputError(f"{sessions}: expected a folder of sessions, this is a file")
    pace = learn_durations(sessions, plan.rig.rig)
    steps = plan.steps()
    console = Console(stderr=True, markup=False)
    console.print(_table(steps, pace))
    total = sum(step.captures for step in steps)
    console.print(
        f"{total} shots, {emission(total, pace)}; {duration(sum(map(pace.seconds, steps)))} in all",
        highlight=False,
    )
    if trials := MOST_TRIALS * sum(step.placements for step in steps):
        console.print(
            f"Where the camera's exposure is set, each placement takes up to {MOST_TRIALS} trials more, of"
            f" all lasers at once: at most {trials}, {emission(trials, pace, LIT_FRAMES)}.",
            highlight=False,
        )
    console.print(_told_by(pace, plan.rig.rig), highlight=False)


def emission(shots: int, pace: StepDurations, lit_frames: int = 1) -> str:
    """Seconds of emission, as measured before or as the lease bounds them."""
    if pace.lit_s is None:
        return f"at most {shots * LEASE_S:.0f} s of emission (leases of {LEASE_S:g} s)"
    return f"{lit_frames * shots * pace.lit_s:.1f} s of emission"


def duration(seconds: float) -> str:
    """For people: seconds below two minutes, then minutes, then hours."""
    if seconds < 120:
        return f"{seconds:.0f} s"
    if seconds < 7200:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h"


def _table(steps: list[PlannedStep], pace: StepDurations) -> Table:
    table = Table(title="Plan", title_justify="left")
    table.add_column("step", overflow="fold")
    table.add_column("", overflow="fold")
    for column in ("placements", "shots", "emission", "time"):
        table.add_column(column, justify="right")
    for step in steps:
        lit_s = step.captures * (LEASE_S if pace.lit_s is None else pace.lit_s)
        counts = (
            [str(step.placements), str(step.captures), f"{lit_s:.1f} s"] if step.captures else ["", "", ""]
        )
        name = f"{step.procedure}.{step.index}"
        table.add_row(name, step.title, *counts, duration(pace.seconds(step)))
    return table


def _told_by(pace: StepDurations, rig: str) -> str:
    if pace.sessions == 0:
        return (
            f"Times are guesses: {pace.placing_s:g} s to place the target, {pace.exposing_s:g} s for the"
            f" exposure, {pace.capture_s:g} s a shot; no session of {rig} has told them yet."
        )
    sessions = "the last session" if pace.sessions == 1 else f"the last {pace.sessions} sessions"
    return f"Times as {sessions} of {rig} told them, in the mean, without breaks while placing the target."
