"""Drives of a sensor on the virtual bench in this process: rendered frames, no session, no journal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from tests.bench.sensors import calibration_of
from workbench.emulator.camera import EmulatedCamera
from workbench.emulator.scene import BenchScene
from workbench.emulator.sensor import ImageSensor
from workbench.emulator.spec import emulator_spec
from workbench.emulator.spot import ImageFormat
from workbench.emulator.truth import draw_truth
from workbench.model.rig import Rig
from workbench.model.target import Placement, WorldTarget
from workbench.model.trial_event import TrueValues
from workbench.model.world import Pose
from workbench.ranging.acquire import acquire
from workbench.ranging.ranger import Ranger
from workbench.spots import Finding, find_spots
from workbench.trials.drive.outcome import DriveRecord, StepRecord
from workbench.trials.drive.sonar import SonarView
from workbench.trials.drive.step import DriveStep
from workbench.trials.drive.surroundings import Surroundings
from workbench.trials.drive.truth import TruthSource
from workbench.trials.readings import ClosestRange, reading_taken


@dataclass
class DrivenSensor:
    """Sensor of a rig with its hidden truth and a calibration; the exposure is metered at every pose."""

    rig: Rig
    ranger: Ranger
    scene: BenchScene
    camera: EmulatedCamera
    lit: tuple[str, ...] = ()

    @classmethod
    def of(cls, rig: Rig, folder: Path) -> DrivenSensor:
        """Sensor with the truth that the rig's seed draws, calibrated."""
        spec = emulator_spec(rig)
        scene = BenchScene(rig, spec, draw_truth(rig, spec), folder / f"{spec.seed}.truth.yaml")
        sensor = ImageSensor(spec, ImageFormat(rig.camera.width_px, rig.camera.height_px), rig.camera.bits)
        found = cls(rig, Ranger(calibration_of(rig)), scene, EmulatedCamera(spec, scene, sensor, tuple))
        found.camera = EmulatedCamera(spec, scene, sensor, lambda: found.lit)
        return found

    def drive(self, key: str, step: DriveStep, around: Surroundings, poses: Sequence[Pose]) -> DriveRecord:
        """Drive along poses, with the trial's own truth, sonar and outcome."""
        truth = TruthSource(around, step.vehicle, self.ranger.sensor, self.rig.bench.target_tilt_sd_deg)
        sonar = SonarView(step.sonar, around, step.vehicle)
        noise = np.random.default_rng([step.seed, len(key)])
        records = []
        for number, pose in enumerate(poses):
            at = truth.at(pose)
            target = WorldTarget(
                world=step.world, vehicle=step.vehicle, pose=pose, speed_mm_s=step.brakes.speed_mm_s
            )
            placed = Placement(key=key, standoff_mm=1000.0, standoff_sd_mm=1000.0, target=target)
            self.scene.place(placed)
            front_mm = at.front_mm if np.isfinite(at.front_mm) else 1e6
            row = max(self.ranger.sensor.rows, key=lambda one: len(one.members))
            true = TrueValues(range_mm=front_mm, range_sd_mm=at.front_sd_mm)
            closest = ClosestRange(true, self.ranger.sensor.front_mm(row, front_mm), row)
            scene = f"{key}/{number:03d}"
            reading = acquire(self.ranger, scene, partial(self._capture, scene))
            taken = reading_taken(self.rig, self.ranger.sensor, "drive", placed, number, reading, closest)
            if not at.front_is_one:
                taken = taken.model_copy(update={"reference_sd_mm": None})
            echo_mm = sonar.echo_mm(pose)
            error = float(noise.standard_normal()) * step.sonar.relative_sd
            records.append(
                StepRecord(number, pose, at, taken, None if echo_mm is None else echo_mm * (1 + error), None)
            )
        return DriveRecord.of(key, step, around.names, records)

    def _capture(self, scene: str, ids: tuple[str, ...]) -> Finding:
        self.camera.mark(f"{scene}/{'-'.join(ids)}")
        self.lit = ids
        on = self.camera.grab().image
        self.lit = ()
        off = self.camera.grab().image
        return find_spots(
            on,
            off,
            scanlines=self.ranger.searched(ids),
            expected=len(ids),
            speckle_sd_px=self.ranger.speckle_sd_px,
        )
