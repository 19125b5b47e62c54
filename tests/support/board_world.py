"""Corners and spots of a made-up board, by numpy and OpenCV's lens: independent of `workbench.optics`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from tests.support.rigs import World
from workbench.calibration.data.boards import BoardView
from workbench.calibration.data.observations import Observation, PlacementInfo
from workbench.corners.board import BoardCorners
from workbench.model.board import sag_mm

CORNER_SD_PX = 0.02
TILTED_SD_MM = 10.0
PLACINGS = (
    (200.0, 0.0, 0.0),
    (300.0, 0.0, 0.0),
    (420.0, 0.0, 0.0),
    (280.0, 35.0, 0.0),
    (280.0, -35.0, 0.0),
    (280.0, 0.0, 35.0),
    (280.0, 0.0, -35.0),
)
"""Standoff, yaw, pitch."""


@dataclass(frozen=True)
class Stood:
    """A plane z = z0 + slope_x x + slope_y y."""

    z0_mm: float
    slope_x: float
    slope_y: float


@dataclass
class BoardWorld:
    """A true sensor and a true board, drawn from a rig's tolerances."""

    world: World

    def __post_init__(self) -> None:
        rig, values = self.world.rig, self.world.values
        self.rng = np.random.default_rng([self.world.seed, 2])
        values["print_scale"] = self.rng.normal(rig.bench.print_scale.value, rig.bench.print_scale.sd)
        for name in ("bow_x_mm", "bow_y_mm", "bow_xy_mm"):
            values[name] = self.rng.normal(0.0, rig.bench.board_flatness_sd_mm)

    def measure(
        self, placings: Sequence[tuple[float, float, float]] = PLACINGS, repeats: int = 4
    ) -> tuple[list[Observation], list[BoardView]]:
        """A capture of the board at every placing, with noise."""
        seen = [self._placing(f"B{n}", *placing, repeats) for n, placing in enumerate(placings)]
        return [s for observations, _ in seen for s in observations], [view for _, view in seen]

    def _placing(
        self, key: str, standoff: float, yaw: float, pitch: float, repeats: int
    ) -> tuple[list[Observation], BoardView]:
        rig, values, rng = self.world.rig, self.world.values, self.rng
        sd = TILTED_SD_MM if yaw or pitch else rig.bench.placement_sd_mm
        stated_sd_mm = sd if yaw or pitch else float("nan")
        turn = np.radians(np.array([yaw, pitch]) + rng.normal(0.0, rig.bench.tilt_sd_deg, 2))
        slopes = np.tan(turn + self.world.common_tilt)
        z0 = standoff * (1 + values["ruler_scale"]) + rng.normal(0.0, sd) + values["offset_mm"]
        stood = Stood(float(z0), *map(float, slopes))
        corners = self._corners(stood)
        view = BoardView(PlacementInfo(key, standoff, stated_sd_mm, 0.0, key), corners)
        observations = []
        for laser in rig.lasers:
            spot = self.world.pixel(laser.id, stood.z0_mm, *np.arctan(slopes))
            spot = spot + rng.normal(0.0, rig.noise.speckle_sd_px, 2)
            for repeat in range(repeats):
                u, v = spot + rng.normal(0.0, rig.noise.spot_sd_px, 2)
                source = f"{key} {laser.id} {repeat}"
                observations.append(
                    Observation(source, laser.id, key, standoff, repeat, u, v, standoff_sd_mm=stated_sd_mm)
                )
        return observations, view

    def _corners(self, stood: Stood) -> BoardCorners:
        """A board laid on the plane by hand, seen with noise; corners outside the picture are not."""
        values, rng, board = self.world.values, self.rng, self.world.rig.board
        normal = np.array([-stood.slope_x, -stood.slope_y, 1.0])
        normal /= np.linalg.norm(normal)
        # Any frame on the plane will do: this one is OpenCV's shortest turn from the axis to the normal.
        axis = np.cross([0.0, 0.0, 1.0], normal)
        angle = np.arctan2(np.linalg.norm(axis), normal[2])
        turn = cv2.Rodrigues(angle * axis / max(np.linalg.norm(axis), 1e-12))[0]
        roll = cv2.Rodrigues(np.array([0.0, 0.0, np.radians(rng.normal(0.0, 1.0))]))[0]
        x, y = rng.normal(0.0, 3.0, 2)
        middle = np.array([x, y, stood.z0_mm + stood.slope_x * x + stood.slope_y * y])
        printed = board.corners_mm
        sag = sag_mm(np.array([values[n] for n in ("bow_x_mm", "bow_y_mm", "bow_xy_mm")]), printed)
        on_board = np.column_stack([printed * (1 + values["print_scale"]), sag])
        points = middle + on_board @ (turn @ roll).T
        pixels = self.world.pixels(points)
        seen = np.flatnonzero(((pixels > 6) & (pixels < [633, 473])).all(axis=1))
        noisy = pixels[seen] + rng.normal(0.0, CORNER_SD_PX, (len(seen), 2))
        return BoardCorners(seen, noisy, np.full((len(seen), 2), CORNER_SD_PX), 0)
