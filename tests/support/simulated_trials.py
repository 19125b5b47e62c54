"""Readings of targets by sensors drawn from a calibration, from spots by numpy: nothing is rendered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import hypot, radians, tan

import numpy as np

from tests.support.drawn_sensors import changed_sensor, drawn_values
from workbench.model.arrays import FloatArray
from workbench.model.event import LaserRange, ReadingTaken
from workbench.model.rig import Rig
from workbench.model.target import CylinderTarget, FlatTarget, Placement
from workbench.optics.rays import RAY
from workbench.ranging.ranger import Ranger, Reading
from workbench.sensor.calibrated import CalibratedSensor
from workbench.trials.readings import ClosestRange, reading_taken

CROSSING_STEPS = 60
"""Steps of the iteration for the crossing of a beam and a cylinder; beams are nearly parallel to the axis."""


@dataclass(frozen=True)
class SimulatedBench:
    """True sensor, ruler and rail, drawn once for a run; placements are drawn one by one."""

    ranger: Ranger
    rig: Rig
    true: CalibratedSensor
    random: np.random.Generator
    scale: float
    """Relative error of the ruler."""
    tilt: tuple[float, float]
    """Slopes of the tilt common to all placements, about the vertical and the horizontal."""
    unknown_placement_sd_mm: float = 0.0
    """Further placement error that no uncertainty states."""
    unknown_noise_px: float = 0.0
    """Further noise of every spot that no uncertainty states."""

    @classmethod
    def draw(
        cls,
        ranger: Ranger,
        rig: Rig,
        seed: int,
        change: Mapping[str, float] | None = None,
        same_bench: bool = False,
    ) -> SimulatedBench:
        """Bench of run `seed`.

        Args:
            ranger: ranger with the calibration.
            rig: rig with the tolerances of the bench.
            seed: number of the run.
            change: changes of the sensor's parameters since the calibration.
            same_bench: whether ruler and rail are those of the calibration, with their errors.
        """
        random, bench = np.random.default_rng([2026, seed]), rig.bench
        values = drawn_values(ranger.calibration, random)
        true = changed_sensor(ranger.calibration, values, change or {})
        if same_bench:
            slopes = (values["target_slope_x"], values["target_slope_y"])
            return cls(ranger, rig, true, random, values["ruler_scale"], slopes)
        own = np.tan(np.radians(random.normal(0.0, bench.target_tilt_sd_deg, 2))).tolist()
        common = (own[0] + bench.target_slope_x.value, own[1] + bench.target_slope_y.value)
        scale = random.normal(bench.ruler_scale.value, bench.ruler_scale.sd)
        return cls(ranger, rig, true, random, scale, common)

    def with_unknown(self, *, placement_sd_mm: float = 0.0, noise_px: float = 0.0) -> SimulatedBench:
        """The same bench with sources of error that no uncertainty states."""
        return replace(self, unknown_placement_sd_mm=placement_sd_mm, unknown_noise_px=noise_px)

    def readings(
        self,
        name: str,
        placement: Placement,
        count: int,
        closest: ClosestRange | None = None,
        without: Sequence[str] = (),
    ) -> list[tuple[ReadingTaken, Reading]]:
        """Readings of a target at one placement: placement, tilt and speckle drawn once, noise for each.

        The spots of the lasers in `without` are missing.
        """
        still = self._still_px(placement)
        noise = self.ranger.calibration.laser_ranger.noise
        found = []
        for number in range(count):
            sd = np.full_like(still, noise.spot_sd_px)
            px = still + self.random.normal(0.0, hypot(noise.spot_sd_px, self.unknown_noise_px), still.shape)
            scene = f"{placement.key}/{number:02d}"
            seen = [n for n, i in enumerate(self.true.ids) if i not in without]
            ids = [self.true.ids[n] for n in seen]
            reading = self.ranger.read_known(scene, len(self.true.ids), ids, px[seen], sd[seen])
            found.append(
                (
                    reading_taken(self.rig, self.ranger.sensor, name, placement, number, reading, closest),
                    reading,
                )
            )
        return found

    def spot_readings(self, name: str, placement: Placement, count: int) -> list[ReadingTaken]:
        """`readings` of every laser's spot alone: without the ranger, whose ranges are not needed."""
        still = self._still_px(placement)
        sd = self.ranger.calibration.laser_ranger.noise.spot_sd_px
        found = []
        for number in range(count):
            px = still + self.random.normal(0.0, hypot(sd, self.unknown_noise_px), still.shape)
            lasers = tuple(
                LaserRange(laser_id=i, range_mm=placement.standoff_mm, sigma_mm=1.0, u_px=u, v_px=v)
                for i, (u, v) in zip(self.true.ids, px.tolist(), strict=True)
            )
            found.append(
                ReadingTaken(
                    trial=name,
                    scene=f"{placement.key}/{number:02d}",
                    standoff_mm=placement.standoff_mm,
                    reading=number,
                    status="done",
                    range_mm=placement.standoff_mm,
                    sigma_mm=1.0,
                    lasers=lasers,
                )
            )
        return found

    def _still_px(self, placement: Placement) -> FloatArray:
        """(n, 2) spots without noise, each with its speckle."""
        ranges_mm = self._ranges_mm(placement)
        speckle = self.ranger.calibration.laser_ranger.noise.speckle_sd_px
        px = [self.true.spot_px(i, np.array([mm]))[0] for i, mm in zip(self.true.ids, ranges_mm, strict=True)]
        return np.array(px) + self.random.normal(0.0, speckle, (len(px), 2))

    def _ranges_mm(self, placement: Placement) -> FloatArray:
        """(n,) true ranges of the lasers."""
        bench, target = self.rig.bench, placement.target
        stated = bench.placement_sd_mm if placement.standoff_sd_mm is None else placement.standoff_sd_mm
        error_mm = self.random.normal(0.0, hypot(stated, self.unknown_placement_sd_mm))
        standoff_mm = placement.standoff_mm * (1 + self.scale) + error_mm
        own_deg = self.random.normal(0.0, bench.tilt_sd_deg, 2)
        x, y, tx, ty = _rays(self.true).T
        if isinstance(target, CylinderTarget):
            radius_mm = (target.diameter_mm + self.random.normal(0.0, target.diameter_sd_mm or 0.0)) / 2
            ranges = np.full(len(x), standoff_mm)
            for _ in range(CROSSING_STEPS):
                aside = x + tx * (ranges + self.true.offset_mm) - target.shift_mm
                ranges = standoff_mm + radius_mm - np.sqrt(radius_mm**2 - aside**2)
            return ranges
        assert isinstance(target, FlatTarget)
        if target.turn_sd_deg is not None:
            own_deg = np.array([self.random.normal(0.0, target.turn_sd_deg), own_deg[1]])
        m = tan(radians(target.yaw_deg + float(own_deg[0])) + np.arctan(self.tilt[0]))
        n = tan(radians(target.pitch_deg + float(own_deg[1])) + np.arctan(self.tilt[1]))
        offset = self.true.offset_mm
        # range = standoff + m x + n y at the point (x, y) + (tx, ty) (range + offset) of the beam
        return np.asarray(
            (standoff_mm + m * (x + tx * offset) + n * (y + ty * offset)) / (1 - m * tx - n * ty), np.float64
        )


def _rays(sensor: CalibratedSensor) -> FloatArray:
    """(n, 4) rays of the true sensor: x, y, tx, ty."""
    values = sensor.calibration.geometry() | dict(sensor.overrides)
    return np.array([[values[f"{i}.{name}"] for name in RAY] for i in sensor.ids])
