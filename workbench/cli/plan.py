"""`workbench check` and `workbench plan`: what will happen, before anybody stands at the bench."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from workbench.model.errors import BadInputError
from workbench.model.number_text import duration
from workbench.model.table import Column, Table
from workbench.procedure.capture.exposure import LIT_FRAMES, MOST_TRIALS
from workbench.procedure.capture.latency import LEASE_S
from workbench.procedure.engine.check import check_file
from workbench.procedure.engine.durations import StepDurations, learn_durations
from workbench.procedure.engine.plan import Plan, PlannedStep
from workbench.report.terminal_table import TerminalTable


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
    """Print every step, its captures, their emission, and the time it will take.

    Raises:
        BadInputError: a file is wrong.
    """
    plan = Plan.load(rig_path, procedures)
    if sessions.exists() and not sessions.is_dir():
        raise BadInputError(f"{sessions}: expected a folder of sessions, this is a file")
    pace = learn_durations(sessions, plan.rig.rig)
    steps = plan.steps()
    console = Console(stderr=True, markup=False)
    console.print(TerminalTable(plan_table(steps, pace)))
    total = sum(step.captures for step in steps)
    console.print(
        f"{total} captures, {emission(total, pace)}; {duration(sum(map(pace.seconds, steps)))} in all",
        highlight=False,
    )
    if trials := MOST_TRIALS * sum(step.placements for step in steps):
        console.print(
            f"Where the camera's exposure is set, each placement takes up to {MOST_TRIALS} trials more, of"
            f" all lasers at once: at most {trials}, {emission(trials, pace, LIT_FRAMES)}.",
            highlight=False,
        )
    console.print(_source_of_times(pace, plan.rig.rig), highlight=False)


def emission(captures: int, pace: StepDurations, lit_frames: int = 1) -> str:
    """Seconds of emission, as measured before or as the lease bounds them."""
    if pace.lit_s is None:
        return f"at most {captures * LEASE_S:.0f} s of emission (leases of {LEASE_S:g} s)"
    return f"{lit_frames * captures * pace.lit_s:.1f} s of emission"


def plan_table(steps: Sequence[PlannedStep], durations: StepDurations) -> Table:
    """A row for each step: target placements, captures, seconds of emission, and its duration."""
    return Table(
        name="plan",
        title="Plan",
        columns=(
            Column(key="step", name="step"),
            Column(key="title", name="title"),
            Column(key="placements", name="placements"),
            Column(key="captures", name="captures"),
            Column(key="emission_s", name="emission", unit="s", format=".1f"),
            Column(key="duration_s", name="duration", format="duration"),
        ),
        rows=tuple(_plan_row(step, durations) for step in steps),
    )


def _plan_row(step: PlannedStep, durations: StepDurations) -> tuple[str | float | None, ...]:
    emission_s = step.captures * (LEASE_S if durations.lit_s is None else durations.lit_s)
    counts = (step.placements, step.captures, emission_s) if step.captures else (None, None, None)
    return (f"{step.procedure}.{step.index}", step.title, *counts, durations.seconds(step))


def _source_of_times(pace: StepDurations, rig: str) -> str:
    if pace.sessions == 0:
        return (
            f"Times are defaults: {pace.placing_s:g} s to place the target, {pace.exposing_s:g} s for the"
            f" exposure, {pace.capture_s:g} s a capture; no session of {rig} has measured them yet."
        )
    sessions = "the last session" if pace.sessions == 1 else f"the last {pace.sessions} sessions"
    return f"Times are means of {sessions} of {rig}, without breaks while the target was placed."
