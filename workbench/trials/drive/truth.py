"""Truth of the readings of a drive at one pose, by the world file and the calibrated rays.

The turn of the calibration's frame against the vehicle is known no better than the tilt of the bench's
target, the rig's `target_tilt_sd_deg`. On a face across the way this has no effect. On an inclined one the
true range is uncertain by slope times range times that angle.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

import numpy as np

from workbench.model.arrays import FloatArray
from workbench.model.world import Pose, Vehicle
from workbench.optics.rows import FLATNESS
from workbench.sensor.calibrated import FAR_MM, CalibratedSensor
from workbench.trials.drive.surroundings import Clearance, Surroundings, world_rays

EDGE_MM = 8.0
"""Distance around a beam's axis within which another body makes an edge; beams are narrower."""
FRONT_RAYS = 61
"""Rays over the front of one row of lasers."""
BESIDE = EDGE_MM * np.array([(0, 0, 0), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)])


@dataclass(frozen=True)
class TrueRange:
    """True range of one laser, mm, from the vehicle's front; infinite where its beam meets nothing."""

    range_mm: float
    sd_mm: float
    """Standard uncertainty by the mount of the sensor."""
    body: int
    at_edge: bool
    """Whether another body, or none, is met beside the axis."""


@dataclass(frozen=True)
class StepTruth:
    """Truth at one pose."""

    clearance: Clearance
    lasers: dict[str, TrueRange]
    front_mm: float
    """Smallest range over the front, between the outer lasers of a row."""
    front_sd_mm: float
    front_is_one: bool
    """Whether one body lies before the whole front."""

    @property
    def nearest_beam_mm(self) -> float:
        """Smallest true range of all lasers."""
        return min(one.range_mm for one in self.lasers.values())


class TruthSource:
    """Truth along drives in one world."""

    def __init__(
        self, around: Surroundings, vehicle: Vehicle, sensor: CalibratedSensor, mount_sd_deg: float
    ) -> None:
        self._around, self._vehicle, self._ids = around, vehicle, sensor.ids
        self._mount_sd = radians(mount_sd_deg)
        count = len(sensor.ids)
        start, end = (sensor.positions_mm(sensor.ids, np.full(count, mm)).T for mm in (0.0, 1000.0))
        origins = np.column_stack([start, np.zeros(count)])
        directions = np.column_stack([(end - start) / 1000.0, np.ones(count)])
        fronts = [_front(origins[row.lasers], directions[row.lasers], row.direction) for row in sensor.rows]
        self._beams = count * len(BESIDE)
        self._origins = np.vstack([(origins[:, None] + BESIDE).reshape(-1, 3), *(one for one, _ in fronts)])
        self._directions = np.vstack(
            [np.repeat(directions, len(BESIDE), axis=0), *(one for _, one in fronts)]
        )

    def at(self, pose: Pose) -> StepTruth:
        """Truth at a pose."""
        origins, directions = world_rays(pose, self._vehicle, self._origins, self._directions)
        hits = self._around.first_hits(origins, directions)
        across, down = (world_rays(pose, self._vehicle, row, row)[1] for row in np.eye(3)[:2, None])
        facing = (hits.normal * directions).sum(axis=1)
        slope = np.hypot((hits.normal @ across.T)[:, 0], (hits.normal @ down.T)[:, 0])
        met = np.isfinite(hits.distance_mm)
        sd = np.zeros(len(met))
        sd[met] = self._mount_sd * hits.distance_mm[met] * slope[met] / np.abs(facing[met])
        body = hits.body[: self._beams].reshape(len(self._ids), -1)
        lasers = {
            i: TrueRange(
                float(hits.distance_mm[n * len(BESIDE)]),
                float(sd[n * len(BESIDE)]),
                int(body[n, 0]),
                bool((body[n] != body[n, 0]).any()),
            )
            for n, i in enumerate(self._ids)
        }
        nearest = self._beams + int(hits.distance_mm[self._beams :].argmin())
        return StepTruth(
            self._around.clearance(pose, self._vehicle),
            lasers,
            float(hits.distance_mm[nearest]),
            float(sd[nearest]),
            len(np.unique(hits.body[self._beams :])) == 1,
        )


def _front(origins: FloatArray, directions: FloatArray, along: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rays over the front of one row of lasers, interpolated between theirs.

    Args:
        origins: (n, 3) of the row's beams.
        directions: (n, 3) likewise.
        along: (2,) direction of the row.
    """
    places = origins[:, :2] @ along
    if np.ptp(places) <= FLATNESS * np.ptp(places + directions[:, :2] @ along * FAR_MM):
        places = directions[:, :2] @ along  # all beams leave the sensor at one point
    order = np.argsort(places)
    at = np.linspace(places[order[0]], places[order[-1]], FRONT_RAYS)
    rays = (
        np.column_stack([np.interp(at, places[order], values[order, k]) for k in range(3)])
        for values in (origins, directions)
    )
    origin, direction = rays
    return origin, direction
