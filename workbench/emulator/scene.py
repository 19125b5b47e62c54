"""Scene in front of the emulated sensor: target surfaces, and the image of each laser on them."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property
from pathlib import Path

from workbench.emulator.beam import Beam
from workbench.emulator.board import BoardSurface, Print, stand
from workbench.emulator.head import reading_error_deg, turned
from workbench.emulator.keyed import generator
from workbench.emulator.lens import STEADY, Drift, Lens, SightMap
from workbench.emulator.spec import EmulatorSpec, SurfaceSpec
from workbench.emulator.speckle import SpeckleMap
from workbench.emulator.spot import ImageFormat, PaintTables, SpotImage, SpotPainter, grain_px, streaked
from workbench.emulator.surfaces import (
    CylinderSurface,
    PlaneSurface,
    PolynomialSurface,
    Surface,
    wall_in_mirror,
)
from workbench.emulator.truth import (
    BoardError,
    PlacementError,
    Truth,
    TruthFile,
    draw_board_error,
    draw_placement_error,
)
from workbench.emulator.world import WorldBodies, WorldView
from workbench.model.arrays import Float32Array
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig
from workbench.model.target import (
    BoardTarget,
    CylinderTarget,
    FlatTarget,
    Placement,
    PolynomialTarget,
    TargetShape,
    WorldTarget,
)
from workbench.model.world import World

DRIFT_STEP = Drift(f_scale=4e-6, u_px=1e-3, v_px=1e-3)
"""Drift of the camera after which spots are painted again: 1e-3 px at the edge of the image."""


class BenchScene:
    """Target of the virtual bench, placed with the errors of the hidden truth."""

    def __init__(self, rig: Rig, spec: EmulatorSpec, truth: Truth, truth_file: Path) -> None:
        self._rig, self._spec, self._truth = rig, spec, truth
        self._file = TruthFile(truth_file, spec, truth)
        self._image = ImageFormat(rig.camera.width_px, rig.camera.height_px)
        self._beams = {name: Beam(ray, spec.beam) for name, ray in truth.lasers.items()}
        self._turn_head("", 0.0)
        self._surfaces: list[tuple[Surface, float]] = []
        self._world: WorldView | None = None
        self._known_world: tuple[World, WorldBodies] | None = None
        self._paint_tables: tuple[Drift, PaintTables] | None = None
        self._blocked: tuple[str, ...] = ()
        self._key = ""
        self._drift = STEADY
        self._spots: dict[str, list[tuple[SpotImage, tuple[float, float]]]] = {}
        """Spots of each laser, with their motion in the image, px/s."""
        self._picture: Float32Array | None = None
        self.moves = 0
        """Number of placements."""

    @property
    def laser_ids(self) -> tuple[str, ...]:
        """Ids of all lasers of the rig."""
        return tuple(self._beams)

    def place(self, placement: Placement) -> Placement:
        """Place the target; the ruler shows the requested standoff, from which the truth differs.

        Raises:
            BadInputError: a flat target or the board is turned by 90 degrees or more.
        """
        target = placement.target
        turn_sds_deg = target.turn_sds_deg if isinstance(target, FlatTarget) else (None, None)
        own = draw_placement_error(self._rig, self._spec, placement.key, turn_sds_deg, placement.attempt)
        error = replace(
            own,
            yaw_deg=own.yaw_deg + self._truth.target_yaw_deg,
            pitch_deg=own.pitch_deg + self._truth.target_pitch_deg,
        )
        z_mm = placement.standoff_mm * (1 + self._truth.ruler_scale) + error.error_mm + self._truth.offset_mm
        self._world = None
        if isinstance(placement.target, WorldTarget):
            self._world = WorldView(self._bodies(placement.target), placement.target, self._truth.offset_mm)
            self._surfaces = []
        elif isinstance(placement.target, BoardTarget):
            aside = self._put_board(placement.target, z_mm, error, placement.key)
            self._file.add(placement.key, own, aside)
        else:
            self._surfaces = _surfaces(placement.target, z_mm, error, self._spec.surface)
            self._file.add(placement.key, own)
        self._turn_head(placement.key, placement.head_deg or 0.0)
        self._key, self._blocked = _speckle_key(placement), placement.blocked
        self._spots, self._picture = {}, None
        self.moves += 1
        return placement

    def spots(self, laser_id: str, drift: Drift = STEADY, exposure_s: float = 0.0) -> list[SpotImage]:
        """Spots of one laser (two on a mirror-like target or an edge), with the camera's drift.

        In a world they are streaks by the vehicle's motion during the exposure.
        """
        self._drift_to(drift)
        if laser_id not in self._spots:
            self._spots[laser_id] = self._paint(laser_id)
        found = self._spots[laser_id]
        if self._world is None or not self._world.speed_mm_s:
            return [spot for spot, _ in found]
        return [streaked(spot, (exposure_s * u, exposure_s * v), self._image) for spot, (u, v) in found]

    def picture(self, drift: Drift = STEADY) -> Float32Array | None:
        """Board in room light (height, width), with the camera's drift; None for other targets."""
        board = self._surfaces[0][0] if self._surfaces else None
        if not isinstance(board, BoardSurface):
            return None
        self._drift_to(drift)
        if self._picture is None:
            self._picture = board.lit_by_room(self._lens(), self._image, self._spec.lens.blur_px)
        return self._picture

    def _turn_head(self, key: str, reading_deg: float) -> None:
        """Turn the scanning head of a rig that has one, with the error of its encoder."""
        head = self._truth.head
        if head is not None:
            error_deg = reading_error_deg(head, self._spec, key, reading_deg)
            ray = turned(self._truth.lasers[head.laser], head, reading_deg + error_deg)
            self._beams[head.laser] = Beam(ray, self._spec.beam)

    def _drift_to(self, drift: Drift) -> None:
        stepped = Drift(
            *(
                still + step * round((now - still) / step)
                for now, still, step in zip(drift, STEADY, DRIFT_STEP, strict=True)
            )
        )
        if stepped != self._drift:
            self._drift, self._spots, self._picture = stepped, {}, None

    def _lens(self) -> Lens:
        return Lens(self._truth, self._drift)

    @cached_property
    def _print(self) -> Print:
        return Print(self._rig.banded_board, self._spec.surface.ink_albedo / self._spec.surface.albedo)

    def _put_board(self, target: BoardTarget, z_mm: float, error: PlacementError, key: str) -> BoardError:
        """Place the board on its plane, with the error of an operator."""
        _check_turn("board", target.yaw_deg + error.yaw_deg, target.pitch_deg + error.pitch_deg)
        aside = draw_board_error(self._truth, self._spec, key, z_mm)
        board = stand(target, z_mm, error, aside, self._truth, self._print, self._spec.surface)
        self._surfaces = [(board, 1.0)]
        return aside

    def _paint(self, laser_id: str) -> list[tuple[SpotImage, tuple[float, float]]]:
        if laser_id in self._blocked:
            return []
        beam, lens, key = self._beams[laser_id], self._lens(), (self._key, laser_id)
        tables = None if self._world is None else self._tables
        painter = SpotPainter(self._spec, lens, self._image, self._truth.f_px, tables)
        if self._world is not None:
            met = self._world.met_by(beam)
            found = [(painter.paint(beam, one, 1.0, (*key, str(one.index))), one) for one in met]
            return [(spot, self._world.motion(beam, one, lens)) for spot, one in found if spot is not None]
        painted = [
            painter.paint(beam, surface, gain, (*key, str(index)))
            for index, (surface, gain) in enumerate(self._surfaces)
        ]
        return [(spot, (0.0, 0.0)) for spot in painted if spot is not None]

    def _bodies(self, target: WorldTarget) -> WorldBodies:
        if self._known_world is None or self._known_world[0] is not target.world:
            self._known_world = target.world, WorldBodies(target.world, self._spec.surface.albedo)
        return self._known_world[1]

    @property
    def _tables(self) -> PaintTables:
        """Tables for fast rendering; lines of sight follow the drift of the camera."""
        if self._paint_tables is None or self._paint_tables[0] != self._drift:
            sight = SightMap(self._lens(), self._image.width, self._image.height)
            self._paint_tables = self._drift, PaintTables(self._speckle_map, sight)
        return self._paint_tables[1]

    @cached_property
    def _speckle_map(self) -> SpeckleMap:
        """Speckle of every pixel, for worlds, in which each pose has another."""
        rng = generator(self._spec.seed, "speckle map")
        return SpeckleMap(grain_px(self._spec), self._spec.beam.speckle_contrast, rng)


def _speckle_key(placement: Placement) -> str:
    """Key of the speckle pattern, of each placement, each displacement along the face, and each angle."""
    key = placement.key
    if isinstance(placement.target, WorldTarget):
        pose = placement.target.pose
        key += f"/{pose.x_mm!r}/{pose.y_mm!r}/{pose.heading_deg!r}"
    elif shift_mm := getattr(placement.target, "shift_mm", 0.0):
        key += f"/{shift_mm:g}mm"
    return f"{key}/{placement.head_deg!r}deg" if placement.head_deg else key


def _surfaces(
    target: TargetShape, z_mm: float, error: PlacementError, finish: SurfaceSpec
) -> list[tuple[Surface, float]]:
    """Surfaces of the target, each with its share of light after reflections."""
    if isinstance(target, FlatTarget):
        return _flat(target, z_mm, error, finish)
    if isinstance(target, CylinderTarget):
        radius = target.diameter_mm / 2
        return [(CylinderSurface(target.shift_mm, z_mm + radius, radius, finish.albedo), 1.0)]
    if isinstance(target, PolynomialTarget):
        return [(PolynomialSurface(z_mm, target.coefficients, target.shift_mm, finish.albedo), 1.0)]
    return []


def _check_turn(what: str, yaw_deg: float, pitch_deg: float) -> None:
    if max(abs(yaw_deg), abs(pitch_deg)) >= 90:
        raise BadInputError(
            f"{what} target: expected a rotation below 90 deg (including the tilt error),"
            f" got yaw {yaw_deg:.3g} and pitch {pitch_deg:.3g}"
        )


def _flat(
    target: FlatTarget, z_mm: float, error: PlacementError, finish: SurfaceSpec
) -> list[tuple[Surface, float]]:
    yaw, pitch = target.yaw_deg + error.yaw_deg, target.pitch_deg + error.pitch_deg
    _check_turn("flat", yaw, pitch)
    albedos = {
        "matt": finish.albedo,
        "absorbent": finish.absorbent_albedo,
        "mirror": finish.mirror_albedo,
    }
    face = PlaneSurface(
        z_mm,
        math.tan(math.radians(yaw)),
        math.tan(math.radians(pitch)),
        albedos[target.finish],
        half_width_mm=(target.width_mm or math.inf) / 2,
        half_height_mm=(target.height_mm or math.inf) / 2,
        centre_x_mm=target.shift_mm,
    )
    surfaces: list[tuple[Surface, float]] = [(face, 1.0)]
    if target.finish == "mirror":
        wall = wall_in_mirror(face, -finish.wall_behind_mm, finish.albedo)
        if wall is not None:
            surfaces.append((wall, finish.mirror_reflectance**2))
    return surfaces
