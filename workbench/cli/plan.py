"""`workbench plan`: forecast of a session."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from workbench.cli.console import result_console
from workbench.model.errors import BadInputError
from workbench.model.number_text import duration
from workbench.model.table import Column, Table
from workbench.model.target import Placement
from workbench.procedure.capture.exposure import LIT_FRAMES, MOST_TRIALS
from workbench.procedure.capture.latency import LEASE_S
from workbench.procedure.engine.durations import StepDurations, learn_durations
from workbench.procedure.engine.existing_calibration import GIVES
from workbench.procedure.engine.plan import Plan, PlannedStep
from workbench.report.terminal_table import TerminalTable
from workbench.session.caller import now

if TYPE_CHECKING:
    from workbench.trials.spot_map import SpotMap

MOST_LOST = 12
"""Largest number of placements with lost spots that are printed."""


def print_plan(
    procedures: list[Path], rig_path: Path, sessions: Path, calibration: Path | None = None
) -> None:
    """Print every step with its captures, emission and duration.

    Raises:
        BadInputError: a file is wrong.
    """
    plan = Plan.load(rig_path, procedures, calibration)
    if sessions.exists() and not sessions.is_dir():
        raise BadInputError(f"{sessions}: expected a folder of sessions, got a file")
    durations = learn_durations(sessions, plan.rig.rig)
    steps = plan.steps()
    console = result_console()
    if plan.calibration is not None:
        console.print(plan.calibration.loaded(now()).text, highlight=False)
    console.print(TerminalTable(plan_table(steps, durations)))
    total = sum(step.captures for step in steps)
    console.print(
        f"{total} captures, {emission(total, durations)}; {duration(sum(map(durations.seconds, steps)))} in"
        " total",
        highlight=False,
    )
    if trials := MOST_TRIALS * sum(step.placements for step in steps):
        console.print(
            f"If the camera's exposure is set, each placement takes up to {MOST_TRIALS} trial exposures more,"
            f" with all lasers on: at most {trials}, {emission(trials, durations, LIT_FRAMES)}.",
            highlight=False,
        )
    console.print(_source_of_times(durations, plan.rig.rig), highlight=False)
    for line in lost_spot_lines(plan):
        console.print(line, highlight=False)


def lost_spot_lines(plan: Plan) -> list[str]:
    """Spots that the trials of a plan will lose or find merged, by the calibration or the rig's design."""
    trials = [
        placement
        for procedure in plan.procedures
        for index, step in enumerate(procedure.steps, start=1)
        if step.needs == GIVES
        for placement in step.placements(procedure.step_name(index), plan.rig)
    ]
    if not trials:
        return []
    # Imported here: only plans with trials need the lens models.
    from workbench.trials.spot_map import SpotMap

    known = plan.calibration
    spots = SpotMap.of_rig(plan.rig) if known is None else SpotMap.of_calibration(known.calibration, plan.rig)
    lines = [line for placement in trials for line in _lost_at(placement, spots)]
    if not lines:
        return ["Every spot of the trials is expected in the image."]
    more = [f"  and {len(lines) - MOST_LOST} more"] if len(lines) > MOST_LOST else []
    source = "the rig's design" if known is None else "the calibration"
    return [f"Lost or merging spots of the trials, by {source}:", *lines[:MOST_LOST], *more]


def _lost_at(placement: Placement, spots: SpotMap) -> list[str]:
    lost = [f"{laser_id} {cause}" for laser_id, cause in spots.lost(placement).items()]
    merged = [f"{a} and {b} may merge" for a, b in spots.merged(placement)]
    return [f"  {placement.key}: {'; '.join([*lost, *merged])}"] if lost or merged else []


def emission(captures: int, durations: StepDurations, lit_frames: int = 1) -> str:
    """Text of the emission time: as measured in earlier sessions, or bounded by the lease."""
    if durations.lit_s is None:
        return f"at most {captures * LEASE_S:.0f} s of emission (leases of {LEASE_S:g} s)"
    return f"{lit_frames * captures * durations.lit_s:.1f} s of emission"


def plan_table(steps: Sequence[PlannedStep], durations: StepDurations) -> Table:
    """Table of the steps: placements, captures, seconds of emission, duration."""
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


def _source_of_times(durations: StepDurations, rig: str) -> str:
    if durations.sessions == 0:
        return (
            f"Times are defaults, because no session of {rig} has measured them:"
            f" {durations.placing_s:g} s to place the target, {durations.exposing_s:g} s to set the exposure,"
            f" {durations.capture_s:g} s per capture."
        )
    sessions = "the last session" if durations.sessions == 1 else f"the last {durations.sessions} sessions"
    return f"Times are means of {sessions} of {rig}, without breaks between placements."
