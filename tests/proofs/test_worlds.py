"""Proof of drives in worlds, at a small size."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.proofs.worlds import COURSES, DRIVES, RIGS, drawn_poses, drives_of, error_lines, is_inside, table
from tests.support.driven_steps import drive_step
from workbench.model.world import load_world
from workbench.trials.drive.surroundings import Surroundings

ROOT = Path(__file__).parents[2]


def test_two_drives_give_a_row_of_each_world(tmp_path: Path) -> None:
    drives = drives_of("thesis-emulated", 2, 5, tmp_path)
    rows = table("thesis-emulated", drives)
    assert [row.split(" | ")[1] for row in rows] == [course.world for course in COURSES]
    assert len(error_lines("thesis-emulated", drives)) == 1
    for drive in drives:
        if drive.obstacle and drive.is_met:
            assert not any(one.missed for one in drive.outcomes if one.sensor == "nearest spot")


def test_drawn_courses_start_in_the_room_with_room_to_brake() -> None:
    assert DRIVES * len(RIGS) >= 100
    for course in COURSES:
        world = load_world(ROOT / f"procedures/worlds/{course.world}.yaml")
        around, step = Surroundings(world), drive_step(world=world)
        for seed in range(10):
            poses = drawn_poses(around, step, course, np.random.default_rng(seed))
            assert all(is_inside(world, pose) for pose in poses)
            free = [around.clearance(pose, step.vehicle).distance_mm for pose in poses]
            assert min(free) >= step.brakes.distance_mm
