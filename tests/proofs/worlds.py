"""Drives in worlds with drawn courses: `python -m tests.proofs.worlds`, part of `make prove`.

Each run draws a body, the direction from which the vehicle comes, and a course aside of the body's middle;
every `DRIVES_PER_SENSOR` runs a sensor. It drives the last steps with rendered frames. An obstacle on a
collision course that a beam meets while the vehicle can brake must not be missed: then the exit code is 1.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, radians, sin
from pathlib import Path

import numpy as np

from tests.support.driven_sensor import DrivenSensor
from tests.support.stored_output import store
from workbench.model.rig import load_rig
from workbench.model.world import PlaneBody, Pose, World, load_world
from workbench.trials.drive.outcome import NEAREST, SENSORS, SONAR, DriveRecord
from workbench.trials.drive.results import ON_FACE, range_errors
from workbench.trials.drive.step import DriveStep
from workbench.trials.drive.surroundings import Surroundings
from workbench.trials.statistics.coverage import clopper_pearson

ROOT = Path(__file__).parents[2]
WRONG = 0.2
"""Relative error beyond which a range is that of another laser's spot."""
RIGS = ("thesis-emulated", "vehicle-emulated")
DRIVES = 52
"""Drives of each rig, half of them in each world."""
DRIVES_PER_SENSOR = 13
FAR_MM, START_MM, BESIDE_MM = 900.0, 400.0, 500.0
"""Distance from which a course is drawn, clearance at which a drive towards a body starts, and the distance
from a body at which a drive past it starts."""


@dataclass(frozen=True)
class Course:
    """World, the bodies towards which drives are drawn, and the largest distance aside of their middle."""

    world: str
    bodies: tuple[str, ...]
    aside_mm: float


LEGS = [f"{name}/leg-{n}" for name in ("chair-1", "chair-3") for n in (1, 2, 3, 4)]
UPRIGHTS = [f"shelf-1/upright-{n}" for n in (1, 2, 3, 4)]
COURSES = (
    Course("obstacles", ("cube", "prism", "cylinder", "ramp"), 350.0),
    Course("office", (*LEGS, *UPRIGHTS, "table-1/leg-1", "table-2/leg-2"), 130.0),
)


def drawn_poses(
    around: Surroundings, step: DriveStep, course: Course, random: np.random.Generator
) -> list[Pose]:
    """Poses of one drive: up to the braking distance before a body, or past it."""
    while True:
        body = around.names.index(course.bodies[random.integers(len(course.bodies))])
        middle = around.points()[body].mean(axis=0)
        heading, aside = random.uniform(0, 360), random.uniform(-course.aside_mm, course.aside_mm)
        c, s = cos(radians(heading)), sin(radians(heading))
        far = Pose(
            x_mm=middle[0] - FAR_MM * c - aside * s,
            y_mm=middle[1] - FAR_MM * s + aside * c,
            heading_deg=heading,
        )
        free = around.clearance(far, step.vehicle).distance_mm
        if free < START_MM or not is_inside(step.world, far):
            continue  # it would start in or before another body, or behind a wall
        collides = free < FAR_MM + 700.0
        start = far.ahead(free - START_MM if collides else FAR_MM - BESIDE_MM)
        length = START_MM - step.brakes.distance_mm if collides else 1.5 * BESIDE_MM
        return [start.ahead(n * step.step_mm) for n in range(int(length / step.step_mm) + 1)]


def is_inside(world: World, pose: Pose) -> bool:
    """Whether a place lies on the free side of all walls."""
    planes = [one.solid for one in world.placed() if isinstance(one.solid, PlaneBody)]
    at = np.array([pose.x_mm, pose.y_mm, 1.0])
    return all(float((at - plane.point_mm) @ plane.normal) > 0 for plane in planes)


def drives_of(rig_name: str, drives: int, seed: int, folder: Path) -> list[DriveRecord]:
    """Drives of a rig, with a new sensor after every `DRIVES_PER_SENSOR`."""
    rig, found = load_rig(ROOT / f"rigs/{rig_name}.yaml"), []
    worlds = [load_world(ROOT / f"procedures/worlds/{course.world}.yaml") for course in COURSES]
    arounds = [Surroundings(world) for world in worlds]
    start = {"name": "drawn", "start": {"x_mm": 0, "y_mm": 0}, "distance_mm": 10}
    sensor: DrivenSensor | None = None
    for n in range(drives):
        if sensor is None or n % DRIVES_PER_SENSOR == 0:
            assert rig.emulator is not None
            block = rig.emulator | {"seed": 1000 * seed + n}
            sensor = DrivenSensor.of(rig.model_copy(update={"emulator": block}), folder)
        which = n % len(COURSES)
        step = DriveStep.model_validate(
            {"step": "drive", "world": worlds[which].model_dump(), "drives": [start], "seed": seed}
        )
        random = np.random.default_rng([seed, n])
        poses = drawn_poses(arounds[which], step, COURSES[which], random)
        found.append(sensor.drive(f"{COURSES[which].world}/{n}", step, arounds[which], poses))
    return found


def table(rig_name: str, drives: Sequence[DriveRecord]) -> list[str]:
    """Lines of the rows of one rig, one for each world."""
    lines = []
    for course in COURSES:
        own = [drive for drive in drives if drive.key.startswith(f"{course.world}/")]
        courses = [drive for drive in own if drive.obstacle]
        met = [drive for drive in courses if drive.is_met]
        cells = [rig_name, course.world, len(own), len(courses), len(met)]
        cells += [_missed(met, sensor) for sensor in SENSORS]
        cells += [clopper_pearson(_missed(met, NEAREST), len(met))[1] if met else float("nan")]
        unmet = [one for one in courses if not one.is_met]
        cells += [_missed(unmet, sensor) for sensor in (NEAREST, SONAR)]
        cells += [_false(own, sensor) for sensor in SENSORS]
        rest = [o.rest_mm for one in met for o in one.outcomes if o.sensor == NEAREST]
        cells += [min(rest, default=float("nan"))]
        lines.append(" | ".join(f"{cell:.3f}" if isinstance(cell, float) else str(cell) for cell in cells))
    return lines


def error_lines(rig_name: str, drives: Sequence[DriveRecord]) -> list[str]:
    """Lines of the relative errors of lasers on faces, over all sensors of one rig."""
    errors = [one for one in range_errors(drives) if one.quantity == ON_FACE]
    relative = np.array([one.error_mm / one.true_mm for one in errors])
    inside = np.mean([bool(one.inside) for one in errors])
    wrong = float(np.mean(np.abs(relative) > WRONG))
    return [f"{rig_name} | {len(errors)} | {np.median(np.abs(relative)):.5f} | {wrong:.5f} | {inside:.3f}"]


def main() -> int:
    """Drive and print the tables; 1 if an obstacle that a beam meets is missed."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--drives", type=int, default=DRIVES)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    heading = (
        "rig | world | drives | courses | met | missed nearest spot | missed closest | missed sonar |"
        " at most | unmet missed nearest spot | unmet missed sonar | false nearest spot | false closest |"
        " false sonar | least at rest"
    )
    lines, errors, missed = [], [], 0
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as name:
        for rig_name in RIGS:
            drives = drives_of(rig_name, given.drives, given.seed, Path(name))
            lines += table(rig_name, drives)
            errors += error_lines(rig_name, drives)
            missed += _missed([one for one in drives if one.obstacle and one.is_met], NEAREST)
            for one in drives:
                if one.obstacle and one.is_met and _missed([one], NEAREST):
                    print(f"missed: {rig_name} {one.key} {one.obstacle}", flush=True)
    command = f"python -m tests.proofs.worlds --drives {given.drives} --seed {given.seed}"
    out = [
        "",
        "drives",
        heading,
        *lines,
        "",
        "errors of lasers on faces",
        "rig | n | median abs | wrong | inside",
        *errors,
    ]
    store("worlds", "Drives in worlds with drawn courses", command, [*out, ""])
    print(f"{time.monotonic() - began:.0f} s")
    return 1 if missed else 0


def _missed(drives: Sequence[DriveRecord], sensor: str) -> int:
    return sum(one.missed for drive in drives for one in drive.outcomes if one.sensor == sensor)


def _false(drives: Sequence[DriveRecord], sensor: str) -> int:
    return sum(one.false_stop for drive in drives for one in drive.outcomes if one.sensor == sensor)


if __name__ == "__main__":
    sys.exit(main())
