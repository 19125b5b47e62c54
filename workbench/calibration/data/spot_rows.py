"""Observations from captures: the spot of a laser at a standoff, or the reason for its rejection.

The search for spots is imported only where a row has images.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isnan, nan
from typing import TYPE_CHECKING

import numpy as np

from workbench.calibration.data.boards import BoardView, on_boards, see_board
from workbench.calibration.data.observations import Observation, PlacementInfo, RejectedObservation
from workbench.model.captures import ALL_LASERS, BOARD, CaptureRow
from workbench.model.fit_event import Rejected
from workbench.model.rig import LaserSpec, Rig
from workbench.optics.emitters import beams_in_order, beams_together, depths_mm
from workbench.optics.image import bend_px
from workbench.optics.lens_models import lens_model
from workbench.optics.rays import RAY

if TYPE_CHECKING:
    from workbench.spots import Finding, Scanline

NO_STANDOFF = "standoff_mm is empty: a calibration needs known standoffs"
PRIOR_REACH_SD = 4.0
"""Half width of the search band, in standard deviations of the rig file's priors."""
BEAM_HALF_WIDTH_PX = 8.0


def observations_of_rows(
    rig: Rig, rows: Sequence[CaptureRow]
) -> tuple[list[Observation], list[Rejected], list[BoardView]]:
    """Observations in a captures file, rejected rows with their reasons, and views of the board.

    Raises:
        BadInputError: an image cannot be used.
    """
    boards = _see_boards(rig, [row for row in rows if row.laser_id == BOARD])
    lasers = {laser.id: laser for laser in rig.lasers}
    spots = [_sight_row(rig, lasers, row) for row in rows if row.laser_id != BOARD]
    found = on_boards(rig.board, boards, spots)
    observations = [f for f in found if isinstance(f, Observation)]
    rejected = [f for f in (*found, *boards.values()) if isinstance(f, Rejected)]
    return observations, rejected, [b for b in boards.values() if isinstance(b, BoardView)]


def observe(finding: Finding, laser: LaserSpec, observation: Observation) -> Observation | Rejected:
    """`observation` with the position of the only spot of its capture, or its rejection.

    Args:
        finding: spots of a capture with one laser on.
        laser: that laser.
        observation: laser, standoff and source; its position is not yet measured.
    """
    from workbench.spots import Failure, explain

    source = observation.source
    where = f"laser {laser.id} at {observation.standoff_mm:g} mm"
    if len(finding.spots) != 1:
        cause = explain(finding.failures[0]) if finding.failures else ""
        reason = f"{where}: expected one spot, got {len(finding.spots)}. {cause}"
        return Rejected(source, reason) if finding.spots else RejectedObservation(source, reason, observation)
    spot = finding.spots[0]
    # The centre of a spot cut by the border, or merged with another, is biased.
    if bad := [flag for flag in (Failure.AT_EDGE, Failure.MERGED) if flag in spot.flags]:
        return Rejected(source, f"{where}: {bad[0]}: {explain(bad[0])}")
    return replace(
        observation,
        u_px=spot.u_px,
        v_px=spot.v_px,
        u_sd_px=spot.u_sd_px,
        v_sd_px=spot.v_sd_px,
        u_speckle_sd_px=nan if spot.u_speckle_sd_px is None else spot.u_speckle_sd_px,
        v_speckle_sd_px=nan if spot.v_speckle_sd_px is None else spot.v_speckle_sd_px,
        saturated=Failure.SATURATED in spot.flags,
    )


def _in_picture(rig: Rig, observation: Observation) -> Observation | Rejected:
    for name, value, size in (
        ("u_px", observation.u_px, rig.camera.width_px),
        ("v_px", observation.v_px, rig.camera.height_px),
    ):
        if not (isnan(value) or -0.5 <= value < size - 0.5):  # `inside_px`, for each of many rows
            where = f"laser {observation.laser_id} at {observation.standoff_mm:g} mm"
            return Rejected(
                observation.source, f"{where}: {name}: expected -0.5 to {size - 0.5}, got {value:g}"
            )
    return observation


def prior_scanlines(rig: Rig, head_deg: float = 0.0) -> list[Scanline]:
    """Bands of all lasers of a rig, see `prior_scanline`."""
    return [prior_scanline(rig, laser, head_deg) for laser in rig.lasers]


def prior_scanline(rig: Rig, laser: LaserSpec, head_deg: float = 0.0) -> Scanline:
    """Band of the image in which the laser's spots lie, by the rig file: along the image of its baseline.

    Args:
        rig: rig file.
        laser: one of its lasers.
        head_deg: reading of the scanning head, if it turns the laser.
    """
    from workbench.spots import Scanline

    if rig.head is not None and laser.id == rig.head.laser:
        # Imported here: rigs without a head do not need it.
        from workbench.optics.turned_laser import turned_laser

        laser = turned_laser(rig, head_deg)
    camera = rig.camera
    x, y = laser.x_mm.value, laser.y_mm.value
    du, dv = x / (x**2 + y**2) ** 0.5, y / (x**2 + y**2) ** 0.5
    # Uncertainty across the line: principal point and pointing, projected on the normal (-dv, du).
    across = [
        camera.cx_px.sd * dv,
        camera.cy_px.sd * du,
        camera.f_px.value * laser.tx.sd * dv,
        camera.f_px.value * laser.ty.sd * du,
    ]
    reach = PRIOR_REACH_SD * sum(part**2 for part in across) ** 0.5
    u = camera.cx_px.value + camera.f_px.value * laser.tx.value
    v = camera.cy_px.value + camera.f_px.value * laser.ty.value
    bend = bend_px(
        lens_model(camera.lens),
        np.array([p.value for p in camera.lens_priors.values()]),
        np.array([getattr(laser, name).value for name in RAY]),
        depths_mm(rig)[0],
        (camera.width_px, camera.height_px),
        ((u, v), (du, dv)),
    )
    return Scanline(u, v, du, dv, BEAM_HALF_WIDTH_PX + reach + bend)


def sought(rig: Rig, laser: LaserSpec) -> tuple[list[Scanline], int]:
    """Bands and number of the spots in a capture of one laser: of all that are on with it.

    Raises:
        BadInputError: see `beams_in_order`.
    """
    from workbench.spots.search_band import band

    together = beams_together(rig, laser)
    if len(together) == 1:
        return [prior_scanline(rig, laser)], 1
    beams_in_order(rig, together)
    return [band([prior_scanline(rig, one) for one in together])], len(together)


def own_spots(rig: Rig, laser: LaserSpec, finding: Finding) -> Finding:
    """Finding with the spots of one laser alone.

    Where others are on with it, all their spots must be seen: their order along the row is that of the beams.
    Otherwise no spot is the laser's.

    Raises:
        BadInputError: see `beams_in_order`.
    """
    from workbench.spots import Finding

    together = beams_together(rig, laser)
    if len(together) == 1:
        return finding
    if len(finding.spots) != len(together):
        return Finding((), finding.failures)
    in_order, direction = beams_in_order(rig, together)
    u, v = direction.tolist()
    spots = sorted(finding.spots, key=lambda spot: spot.u_px * u + spot.v_px * v)
    return Finding((spots[in_order.index(laser)],), finding.failures)


def _see_boards(rig: Rig, rows: Sequence[CaptureRow]) -> dict[str, BoardView | Rejected]:
    """Views of the board by placement, each from the mean of its frames."""
    placed: dict[str, list[CaptureRow]] = defaultdict(list)
    for row in rows:
        placed[row.placement_key].append(row)
    return {key: _see_board(rig, key, of_one) for key, of_one in placed.items()}


def _see_board(rig: Rig, key: str, rows: Sequence[CaptureRow]) -> BoardView | Rejected:
    from workbench.session.frames import read_image

    first, size = rows[0], (rig.camera.width_px, rig.camera.height_px)
    source = f"row {first.row}"
    tilt = 0.0 if isnan(first.tilt_deg) else first.tilt_deg
    placement = PlacementInfo(key, first.standoff_mm, first.standoff_sd_mm, tilt, source)
    frames = [read_image(row.on, size) for row in rows if row.on is not None]
    return see_board(frames, rig.board, placement)


def _sight_row(rig: Rig, lasers: Mapping[str, LaserSpec], row: CaptureRow) -> Observation | Rejected:
    source = f"row {row.row}"
    if row.laser_id == ALL_LASERS:
        return Rejected(source, "a calibration needs captures of one laser at a time, got all")
    if isnan(row.standoff_mm):
        return Rejected(source, NO_STANDOFF)
    if row.laser_id not in lasers:
        known = ", ".join(lasers)
        return Rejected(source, f"laser_id: expected one of {known} (rig {rig.rig}), got {row.laser_id}")
    observation = Observation(
        source=source,
        laser_id=row.laser_id,
        placement=row.placement_key,
        standoff_mm=row.standoff_mm,
        repeat=row.repeat,
        u_px=row.u_px,
        v_px=row.v_px,
        u_sd_px=row.u_sd_px,
        v_sd_px=row.v_sd_px,
        standoff_sd_mm=row.standoff_sd_mm,
        yaw_deg=0.0 if isnan(row.tilt_deg) else row.tilt_deg,
        time_s=row.time_s,
        part=row.part,
    )
    if row.on is None:
        return _in_picture(rig, observation)
    from workbench.session.capture_spots import find_row_spots

    laser = lasers[row.laser_id]
    size = rig.camera.width_px, rig.camera.height_px
    bits = rig.camera.bits if rig.camera.bits > 8 else None
    found = find_row_spots(row, size, *sought(rig, laser), rig.noise.speckle_sd_px, bits)
    return observe(own_spots(rig, laser, found), laser, observation)
