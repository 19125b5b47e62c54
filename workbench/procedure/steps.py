"""What each kind of step does.

A step takes the context and its own part of the procedure file, and returns one line on how it went; it
raises where the procedure cannot go on.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import asdict
from functools import singledispatch
from math import nan
from zlib import crc32

import numpy as np

from workbench.calibration.data.boards import BoardView, on_boards, see_board
from workbench.calibration.data.observations import Observation, PlacementInfo, Rejected
from workbench.calibration.data.spot_rows import prior_scanline
from workbench.calibration.design.next_standoff import advise
from workbench.calibration.selection.model_terms import fit_chosen
from workbench.calibration.verdict.export import calibrate, render
from workbench.calibration.verdict.records import fit_finished
from workbench.model import event as ev
from workbench.model import procedure as pr
from workbench.model.captures import BOARD
from workbench.model.errors import BadInputError, LimitFailedError
from workbench.model.prompt import Prompt, Quantity
from workbench.model.rig import Rig
from workbench.model.simulation import SimulationFinished
from workbench.model.target import BoardTarget, Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.limits import check_captures, check_fit
from workbench.procedure.engine.observed import observe_capture, observed_so_far
from workbench.procedure.engine.placements import visit_placements
from workbench.ranging.acquire import acquire
from workbench.ranging.ranger import Ranger
from workbench.session.capture_table import CALIBRATION_TABLE, TRIAL_TABLE, write_capture_table
from workbench.session.files import write_record
from workbench.spots import Finding
from workbench.trials.accuracy import accuracy_csv, accuracy_row
from workbench.trials.thesis.simulation import claim_rows, claims_csv, readings_csv, simulate

SIMULATION_SEED = 2001
"""With a scene's name it draws the scene's noise: adding a scene leaves the others as they were."""


@singledispatch
def shots(step: object, rig: Rig) -> int:
    """How many captures a step will take: 0 but for steps that say otherwise.

    An accuracy trial may take more, where the lasers have to be fired one by one.
    """
    return 0


@shots.register
def _(step: pr.CaptureGridStep, rig: Rig) -> int:
    return len(step.standoffs_mm) * step.repeats * len(rig.lasers)


@shots.register
def _(step: pr.CaptureBoardStep, rig: Rig) -> int:
    return len(step.placings) * (step.frames + step.repeats * len(rig.lasers))


@shots.register
def _(step: pr.AccuracyTrialStep, rig: Rig) -> int:
    return len(step.standoffs_mm) * step.readings


@singledispatch
def run_step(step: object, context: Context, name: str) -> str:
    """Run one step; `name` is unique in the session and begins the keys of its captures."""
    raise TypeError(f"no way to run a step of type {type(step).__name__}")


@run_step.register
def _(step: pr.MessageStep, context: Context, name: str) -> str:
    return "shown"


@run_step.register
def _(step: pr.ConfirmStep, context: Context, name: str) -> str:
    context.ask(confirmation(step, name))
    return "confirmed"


@run_step.register
def _(step: pr.AskStep, context: Context, name: str) -> str:
    answer = context.ask(question(step, name))
    unit = "" if step.number is None else f" {step.number.unit}"
    return f"{answer.value}{unit}"


@run_step.register
def _(step: pr.PlaceTargetStep, context: Context, name: str) -> str:
    # What needs it lit, counting the latency, sees to its own exposure: one set now may rest on old frames.
    placed = visit_placements(
        context, [placement_at(name, step.standoff_mm)], lambda placement: placement, lights=False
    )
    return f"at {placed[0].standoff_mm:g} mm" if placed else "left out"


@run_step.register
def _(step: pr.WarmUpStep, context: Context, name: str) -> str:
    context.warm_up(name, step.frames)
    return f"{step.frames} frames"


@run_step.register
def _(step: pr.MeasureLatencyStep, context: Context, name: str) -> str:
    return f"{context.measure_latency(name, step.most_frames)} frames, discarded before each capture"


@run_step.register
def _(step: pr.CheckLimitsStep, context: Context, name: str) -> str:
    if context.accepted is None:
        raise BadInputError(f"step {name}: nothing to check; expected a fit step before it")
    ranger = context.accepted.laser_ranger
    return check_fit(context, name, ranger.fit.model_dump() | ranger.validity.model_dump(), step.limits)


@run_step.register
def _(step: pr.ValidateStep, context: Context, name: str) -> str:
    left_out = context.left_out
    if not left_out:
        raise BadInputError(f"step {name}: nothing to validate; expected a fit of 3 placements or more")
    worst_error = max(abs(one.error_mm) / one.standoff_mm for one in left_out)
    worst_z = max(abs(one.z) for one in left_out)
    verdict = check_fit(context, name, {"worst_relative_error": worst_error, "worst_z": worst_z}, step.limits)
    return (
        f"{len(left_out)} placements, each ranged by a fit without it: to {100 * worst_error:.2g} % or"
        f" better, {worst_z:.2g} sd of what was promised at worst; {verdict}"
    )


@run_step.register
def _(step: pr.CaptureGridStep, context: Context, name: str) -> str:
    placements = [placement_at(name, standoff_mm) for standoff_mm in step.standoffs_mm]

    def work(placement: Placement) -> int:
        pairs = _capture_lasers(context, placement, step.repeats)
        check_captures(context, name, placement, step.limits)
        _advise(context)
        return pairs

    return f"{sum(visit_placements(context, placements, work))} pairs"


@run_step.register
def _(step: pr.CaptureBoardStep, context: Context, name: str) -> str:
    placements = [
        board_placement(name, number, placing, context.rig)
        for number, placing in enumerate(step.placings, start=1)
    ]

    def work(placement: Placement) -> None:
        frames = [
            context.capture_room_light(f"{placement.key}/board/{repeat:02d}", placement, repeat)
            for repeat in range(step.frames)
        ]
        told = PlacementInfo(
            placement.key,
            placement.standoff_mm,
            nan if placement.standoff_sd_mm is None else placement.standoff_sd_mm,
            0.0,
            placement.key,
        )
        context.boards[placement.key] = see_board(frames, context.rig.board, told)
        _capture_lasers(context, placement, step.repeats)

    visit_placements(context, placements, work)
    mine = [seen for key, seen in context.boards.items() if key.startswith(f"{name}/")]
    corners = sum(len(seen.corners.ids) for seen in mine if isinstance(seen, BoardView))
    missed = [seen.reason for seen in mine if isinstance(seen, Rejected)]
    return "; ".join([f"{corners} corners in {len(mine) - len(missed)} of {len(mine)} placements", *missed])


@run_step.register
def _(step: pr.FitStep, context: Context, name: str) -> str:
    captures = [c for c in context.captures if c.purpose == "calibration"]
    if not captures:
        raise BadInputError(f"step {name}: nothing to fit; expected a capture_grid step before it")
    sha256 = write_capture_table(context.session_dir / CALIBRATION_TABLE, captures)
    spots = [observe_capture(context, capture) for capture in captures if capture.laser_id != BOARD]
    found = on_boards(context.rig.board, context.boards, spots)
    observations = [f for f in found if isinstance(f, Observation)]
    rejected = [f for f in (*found, *context.boards.values()) if isinstance(f, Rejected)]
    boards = [b for b in context.boards.values() if isinstance(b, BoardView)]
    fitted = fit_chosen(context.rig, observations, rejected, boards)
    provenance = context.provenance.model_copy(update={"captures_sha256": sha256})
    calibration, assessment = calibrate(fitted, step.limits, provenance)
    context.emit(fit_finished(fitted, assessment))
    if assessment.verdict == "refused":
        raise LimitFailedError("the calibration is refused: " + "; ".join(assessment.reasons))
    context.accepted, context.left_out = calibration, assessment.left_out
    worst = calibration.laser_ranger.validity.max_relative_range_sd
    return (
        f"accepted: rms {fitted.rms_px:.3f} px over {len(observations)} spots, {len(fitted.rejected)} not"
        f" used; ranges to {100 * worst:.2g} % (1 sigma) or better"
    )


@run_step.register
def _(step: pr.ExportStep, context: Context, name: str) -> str:
    if context.accepted is None:
        raise BadInputError(f"step {name}: nothing to export; expected a fit step before it")
    path = context.session_dir / step.file
    content = render(context.accepted).encode()
    write_record(path, content)
    context.calibration = context.accepted
    context.emit(ev.CalibrationExported(path=step.file, sha256=hashlib.sha256(content).hexdigest()))
    return f"{step.file} written"


@run_step.register
def _(step: pr.AccuracyTrialStep, context: Context, name: str) -> str:
    if context.calibration is None:
        raise BadInputError(
            f"step {name}: no calibration to range with; run a procedure with an export step before it,"
            " in the same call"
        )
    ranger = Ranger(context.calibration)

    def work(placement: Placement) -> ev.TrialRow:
        readings = []
        for number in range(step.readings):
            scene = f"{placement.key}/{number:02d}"
            reading = acquire(ranger, scene, _shooter(context, ranger, placement, scene, number))
            readings.append(reading)
            context.emit(
                ev.ReadingTaken(
                    trial=name,
                    scene=scene,
                    standoff_mm=placement.standoff_mm,
                    reading=number,
                    status=reading.status,
                    range_mm=reading.flat_mm,
                    sigma_mm=reading.flat_sigma_mm,
                    lasers=reading.lasers,
                )
            )
        return accuracy_row(placement.standoff_mm, readings, context.rig.bench)

    rows = visit_placements(
        context, [placement_at(name, standoff_mm) for standoff_mm in step.standoffs_mm], work
    )
    trial = [c for c in context.captures if c.purpose == "trial"]
    write_capture_table(context.session_dir / TRIAL_TABLE, trial)
    table = f"{name}.csv"
    write_record(context.session_dir / table, accuracy_csv(rows).encode())
    context.emit(ev.TrialFinished(trial=name, rows=tuple(rows)))
    return f"{sum(row.readings for row in rows)} readings, table in {table}"


@run_step.register
def _(step: pr.ThesisSimulationStep, context: Context, name: str) -> str:
    simulated, rows = [], []
    for scene in step.scenes:
        context.check_stop()
        rng = np.random.default_rng([SIMULATION_SEED, crc32(scene.name.encode())])
        simulated.append(simulate(name, scene, context.rig, scene.points or step.points, rng))
        rows += claim_rows(simulated[-1])
        context.emit(simulated[-1])
    write_record(context.session_dir / f"{name}.csv", claims_csv(rows).encode())
    write_record(context.session_dir / f"{name}-readings.csv", readings_csv(simulated).encode())
    context.emit(SimulationFinished(trial=name, rows=tuple(rows)))
    stated = [row for row in rows if row.reproduced is not None]
    return (
        f"as in the thesis: {sum(row.reproduced is True for row in stated)} of {len(stated)} claims kept;"
        f" ours better in {sum(row.better for row in rows)} of {len(rows)} rows; tables in {name}.csv"
    )


def confirmation(step: pr.ConfirmStep, name: str) -> Prompt:
    """What a `confirm` step asks."""
    return Prompt(name, step.text, step.expect, step.otherwise)


def question(step: pr.AskStep, name: str) -> Prompt:
    """What an `ask` step asks."""
    n = step.number
    quantity = None if n is None else Quantity(n.unit, *n.within, n.usual)
    return Prompt(name, step.text, quantity=quantity, choices=step.choices)


def placement_at(name: str, standoff_mm: float) -> Placement:
    """Where a step of this name has a flat target placed."""
    # 12 digits: keys name files, so standoffs that differ must have keys that differ.
    return Placement(key=f"{name}/{standoff_mm:.12g}mm", standoff_mm=standoff_mm)


def board_placement(name: str, number: int, placing: pr.BoardPlacing, rig: Rig) -> Placement:
    """Where a step of this name has the board placed for the `number`-th time, from 1."""
    upright = all(laser.axis == "v" for laser in rig.lasers)
    target = BoardTarget(
        yaw_deg=placing.yaw_deg, pitch_deg=placing.pitch_deg, roll_deg=90.0 if upright else 0.0
    )
    return Placement(
        key=f"{name}/{number:02d}-{placing.standoff_mm:.12g}mm",
        standoff_mm=placing.standoff_mm,
        target=target,
        standoff_sd_mm=placing.standoff_sd_mm,
    )


def _capture_lasers(context: Context, placement: Placement, repeats: int) -> int:
    """Fire each laser alone, `repeats` pairs of frames each; returns how many pairs."""
    for laser in context.rig.lasers:
        scanline = prior_scanline(context.rig, laser)
        for repeat in range(repeats):
            key = f"{placement.key}/{laser.id}/{repeat:02d}"
            context.capture(key, [laser.id], placement, repeat, [scanline])
    return repeats * len(context.rig.lasers)


def _advise(context: Context) -> None:
    """Tell how far the captures have come; not where the board was seen: its corners would not count."""
    if context.ahead is None or context.boards:
        return
    if (advice := advise(context.rig, observed_so_far(context), context.ahead.planned_mm)) is not None:
        context.emit(ev.StandoffAdvised(limit=context.ahead.limit, **asdict(advice)))


def _shooter(
    context: Context, ranger: Ranger, placement: Placement, scene: str, number: int
) -> Callable[[tuple[str, ...]], Finding]:
    def shoot(ids: tuple[str, ...]) -> Finding:
        alone = len(ids) == 1
        key = f"{scene}/{ids[0] if alone else 'all'}"
        scanlines = ranger.searched(ids)
        shown = f"{scene}/alone" if alone else scene
        return context.capture(key, ids, placement, number, scanlines, scene=shown)

    return shoot
