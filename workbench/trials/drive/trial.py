"""Execution of drives: a reading of the sensor at every step, with truth and sonar."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np

from workbench.model.event import ReadingTaken, TrialProgress, TrueValues, VehicleMoved
from workbench.model.number_text import counted
from workbench.model.prior import LARGEST
from workbench.model.target import Placement, WorldTarget
from workbench.model.trial_event import SensorAnswer
from workbench.model.world import Pose
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.placements import visit_placements
from workbench.ranging.acquire import acquire
from workbench.ranging.ranger import Ranger
from workbench.trials.brightness import follow_brightness
from workbench.trials.drive.outcome import CLOSEST, SONAR, DriveRecord, StepRecord
from workbench.trials.drive.results import drive_results, result_charts, result_tables, step_frame
from workbench.trials.drive.sonar import SonarView
from workbench.trials.drive.step import DriveStep
from workbench.trials.drive.surroundings import Surroundings
from workbench.trials.drive.truth import StepTruth, TruthSource
from workbench.trials.limits import check_results, skipped_results
from workbench.trials.readings import ClosestRange, capture_of, reading_taken, session_ranger
from workbench.trials.results import finish_trial, write_readings


@dataclass(frozen=True)
class _Trial:
    """Common parts of all drives of a trial."""

    context: Context
    name: str
    step: DriveStep
    ranger: Ranger
    truth: TruthSource
    sonar: SonarView
    around: Surroundings


def run_trial(context: Context, name: str, step: DriveStep) -> str:
    """Drive every drive and write the results; returns the outcome in one line.

    Raises:
        BadInputError: there is no calibration.
        LimitFailedError: a limit failed.
        WorkbenchError: see `visit_placements`.
    """
    ranger, around = session_ranger(context, name), Surroundings(step.world)
    truth = TruthSource(around, step.vehicle, ranger.sensor, context.rig.bench.target_tilt_sd_deg)
    trial = _Trial(context, name, step, ranger, truth, SonarView(step.sonar, around, step.vehicle), around)
    placements = step.placements(name, context.rig)
    ways = {placement.key: n for n, placement in enumerate(placements)}
    drives = visit_placements(context, placements, lambda placed: _drive(trial, placed, ways[placed.key]))
    write_readings(context, name, step_frame(drives, around.names, ranger.sensor.ids))
    finish_trial(context, name, result_tables(name, drives, step), result_charts(name, drives))
    driven = {drive.key for drive in drives}
    skipped = [one for one in placements if one.key not in driven]
    check_results(
        context, name, [*drive_results(drives), *skipped_results(skipped, step.limits)], step.limits
    )
    return f"{counted(len(drives), 'drive')}, a row for each step in {name}.csv"


def _drive(trial: _Trial, placed: Placement, index: int) -> DriveRecord:
    """Take a reading at every pose of one drive."""
    context, step = trial.context, trial.step
    noise = np.random.default_rng([step.seed, index])
    records = []
    for number, pose in enumerate(step.ways[index]):
        if number:
            follow_brightness(context)
            _move(context, placed, pose)
        truth = trial.truth.at(pose)
        reading = _read(trial, placed, number, truth)
        echo_mm = trial.sonar.echo_mm(pose)
        error = float(noise.standard_normal()) * step.sonar.relative_sd
        sonar_mm = None if echo_mm is None else echo_mm * (1 + error)
        records.append(StepRecord(number, pose, truth, reading, sonar_mm, context.captures[-1].exposure))
        context.emit(_moved(trial, pose, truth, reading, sonar_mm))
    drive = DriveRecord.of(placed.key, step, trial.around.names, records)
    context.emit(TrialProgress(trial=trial.name, text=drive.text))
    return drive


def _move(context: Context, placed: Placement, pose: Pose) -> None:
    """Move the vehicle; a drive that is replayed from disk moves nothing."""
    if context.pairs.replayed is None and isinstance(placed.target, WorldTarget):
        target = placed.target.model_copy(update={"pose": pose})
        context.bench.target.place(placed.model_copy(update={"target": target}))


def _read(trial: _Trial, placed: Placement, number: int, truth: StepTruth) -> ReadingTaken:
    """Take a reading of the closest range; before several bodies without an interval, which is of one."""
    context, ranger = trial.context, trial.ranger
    row = max(ranger.sensor.rows, key=lambda one: len(one.members))
    front_mm = truth.front_mm if isfinite(truth.front_mm) else LARGEST
    true = TrueValues(range_mm=front_mm, range_sd_mm=truth.front_sd_mm)
    closest = ClosestRange(true, ranger.sensor.front_mm(row, front_mm), row)
    scene = f"{placed.key}/{number:03d}"
    found = acquire(ranger, scene, capture_of(context, ranger, placed, scene, number))
    taken = reading_taken(context.rig, ranger.sensor, trial.name, placed, number, found, closest)
    if not truth.front_is_one:
        taken = taken.model_copy(update={"reference_sd_mm": None})
    context.emit(taken)
    context.readings.append(taken)
    return taken


def _moved(
    trial: _Trial, pose: Pose, truth: StepTruth, reading: ReadingTaken, sonar_mm: float | None
) -> VehicleMoved:
    free_mm, sonar = truth.clearance.distance_mm, trial.step.sonar
    half_mm = 0.0 if sonar_mm is None else 2 * sonar.relative_sd * sonar_mm
    return VehicleMoved(
        trial=trial.name,
        scene=reading.scene,
        pose=pose,
        clearance_mm=free_mm if isfinite(free_mm) else None,
        answers=(
            SensorAnswer(
                sensor=CLOSEST, range_mm=reading.range_mm, low_mm=reading.low_mm, high_mm=reading.high_mm
            ),
            SensorAnswer(
                sensor=SONAR,
                range_mm=sonar_mm,
                low_mm=None if sonar_mm is None else sonar_mm - half_mm,
                high_mm=None if sonar_mm is None else sonar_mm + half_mm,
                full_angle_deg=sonar.full_angle_deg,
            ),
        ),
    )
