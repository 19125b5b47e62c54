"""Steps of a drive made of numbers: one laser, a flat obstacle."""

from __future__ import annotations

from typing import Any

from workbench.model.event import LaserRange, ReadingTaken, TrueValues
from workbench.model.world import Pose
from workbench.trials.drive.outcome import StepRecord
from workbench.trials.drive.step import DriveStep
from workbench.trials.drive.surroundings import Clearance
from workbench.trials.drive.truth import StepTruth, TrueRange

CUBE: dict[str, Any] = {"kind": "box", "name": "cube", "at_mm": [1100, 0], "size_mm": [200, 200, 200]}
WORLD: dict[str, Any] = {"format": 1, "world": "one", "title": "One cube", "bodies": [CUBE]}


def drive_step(**keys: Any) -> DriveStep:
    """Step with one drive towards a cube whose face is at x = 1000 mm."""
    drive = {"name": "d", "start": {"x_mm": 0, "y_mm": 0}, "distance_mm": 950}
    return DriveStep.model_validate({"step": "drive", "world": WORLD, "drives": [drive], **keys})


def step_record(
    number: int,
    clearance_mm: float,
    nearest_mm: float | None = None,
    *,
    sonar_mm: float | None = None,
    beam_mm: float | None = None,
    several: bool = False,
) -> StepRecord:
    """Step at which the only laser reads `nearest_mm` +- 2 mm (1 sigma 1 mm); its beam meets at `beam_mm`."""
    true_mm = clearance_mm if beam_mm is None else beam_mm
    read_mm = true_mm if nearest_mm is None else nearest_mm
    laser = LaserRange(laser_id="L1", range_mm=read_mm, sigma_mm=1.0, u_px=1.0, v_px=1.0)
    known = true_mm < 1e6
    reading = ReadingTaken(
        trial="t",
        scene=f"t/d/{number:03d}",
        standoff_mm=100.0,
        reading=number,
        status="done",
        range_mm=read_mm,
        sigma_mm=1.0,
        low_mm=read_mm - 2,
        high_mm=read_mm + 2,
        reference_sd_mm=None if several else 0.1,
        true=TrueValues(range_mm=true_mm if known else 1e6, range_sd_mm=0.1),
        lasers=(laser,),
    )
    truth = StepTruth(
        Clearance(clearance_mm, 0 if clearance_mm < 1e6 else -1),
        {"L1": TrueRange(true_mm, 0.1, 0 if known else -1, at_edge=False)},
        true_mm,
        0.1,
        not several,
    )
    return StepRecord(number, Pose(x_mm=0, y_mm=0), truth, reading, sonar_mm, 100.0)
