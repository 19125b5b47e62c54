"""The printed board at a placement: its corners in the image, and a starting value of its pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import atan2
from typing import TYPE_CHECKING

import numpy as np

from workbench.calibration.data.observations import MeanObservations, Observation, PlacementInfo
from workbench.model.board import Board
from workbench.model.errors import BadInputError
from workbench.model.fit_event import Rejected
from workbench.model.known_board import AnyBoard
from workbench.model.rig import Rig
from workbench.optics.lens_models import lens_model
from workbench.optics.undistort import undistort

# OpenCV is imported in the functions that need it: a fit of spots alone starts faster.
if TYPE_CHECKING:
    from workbench.corners.board import BoardCorners
    from workbench.model.arrays import Image

FEWEST_CORNERS = 4
"""Number of corners that determine a pose."""
BAND_EDGE_MM = 3.0
"""Least distance of a spot's centre from the edge of the blank band; beams are some 2.5 mm wide there."""


@dataclass(frozen=True)
class BoardView:
    """Corners of the board at one placement."""

    placement: PlacementInfo
    corners: BoardCorners

    def with_wider_sd(self, factor: float) -> BoardView:
        """The view with the deviations of its corners multiplied."""
        return replace(self, corners=replace(self.corners, sd_px=factor * self.corners.sd_px))


@dataclass(frozen=True)
class PoseGuess:
    """Starting value of the board's pose, by the rig file's lens; good to some millimetres and degrees."""

    slope_x: float
    slope_y: float
    x_mm: float
    y_mm: float
    roll_rad: float
    z0_mm: float
    """Depth of the board's plane on the optical axis."""
    distance_mm: float
    """Depth of the board's centre: the scale of all lengths of the pose."""


def see_board(frames: Sequence[Image], board: AnyBoard, placement: PlacementInfo) -> BoardView | Rejected:
    """Corners of the board in the frames of one placement, or the reason why they are not found."""
    from workbench.corners.board import find_board

    try:
        return BoardView(placement, find_board(frames, board))
    except BadInputError as error:
        where = placement.key if placement.is_free else f"{placement.standoff_mm:g} mm"
        return Rejected(placement.source, f"board at {where}: {error}")


def on_band(view: BoardView, board: Board, observation: Observation) -> Observation | Rejected:
    """The observation, or its rejection where the spot lies on the print or beside the board.

    The position on the board is a homography of the corners; lens distortion between them changes it by less
    than a millimetre.
    """
    if not np.isfinite([observation.u_px, observation.v_px]).all():
        return observation
    import cv2

    printed = board.corners_mm[view.corners.ids]
    to_board, _ = cv2.findHomography(view.corners.position_px, printed)
    x, y, w = to_board @ [observation.u_px, observation.v_px, 1.0]
    half_height, half_width = board.band_mm / 2 - BAND_EDGE_MM, board.page_mm[0] / 2
    if abs(y / w) <= half_height and abs(x / w) <= half_width:
        return observation
    return Rejected(
        observation.source,
        f"laser {observation.laser_id} at {observation.standoff_mm:g} mm: the spot lies {y / w:.0f} mm from"
        f" the middle of the board's blank band, expected at most {half_height:g} mm: shift the board",
    )


def on_boards(
    board: AnyBoard, seen: Mapping[str, BoardView | Rejected], found: Sequence[Observation | Rejected]
) -> list[Observation | Rejected]:
    """Reject observations whose spot lies beside the blank band of a board, or on a board not found.

    Args:
        board: the board.
        seen: views of the board (or their rejections) by placement; other placements have a flat target.
        found: observations of any placement, and earlier rejections, which are kept.
    """
    return [_on_board(board, seen.get(f.placement), f) if isinstance(f, Observation) else f for f in found]


def _on_board(
    board: AnyBoard, seen: BoardView | Rejected | None, observation: Observation
) -> Observation | Rejected:
    if seen is None:
        return observation
    where = f"laser {observation.laser_id} at {observation.standoff_mm:g} mm"
    if not isinstance(board, Board):
        reason = (
            f"{where}: a {board.kind} has no blank band for a spot; give its views placements of their own"
        )
        return Rejected(observation.source, reason)
    if isinstance(seen, BoardView):
        return on_band(seen, board, observation)
    return Rejected(observation.source, f"{where}: the board at this placement was not found")


def with_placements(cells: MeanObservations, boards: Sequence[BoardView]) -> MeanObservations:
    """The mean observations, with the placements of the boards added to theirs.

    Raises:
        BadInputError: two boards at one placement, or a board and a spot with different settings of one
            placement.
    """
    known = {p.key: p for p in cells.placements}
    seen: set[str] = set()
    for view in boards:
        own = view.placement
        first = known.setdefault(own.key, own)
        if own.key in seen or first.setting != own.setting:
            raise BadInputError(
                f"{own.source}: standoff_mm: placement {own.key}: expected {first.describe} as in"
                f" {first.source} and one board, got {own.describe}; give each placement its own name"
            )
        seen.add(own.key)
    return replace(cells, placements=tuple(known.values()))


def guess_pose(rig: Rig, view: BoardView) -> PoseGuess:
    """Pose of the board from its corners, with the rig file's lens (IPPE, planar pose estimation).

    Raises:
        BadInputError: too few corners, or no pose in front of the camera with the printed side visible.
    """
    import cv2

    lens = np.array([prior.value for prior in rig.camera.lens_priors.values()])
    directions = undistort(lens_model(rig.camera.lens), lens, view.corners.position_px)
    known = np.isfinite(directions).all(axis=1)
    printed = rig.board.corners_mm[view.corners.ids][known]
    points = np.column_stack([printed, np.zeros(len(printed))])
    mistake = BadInputError(
        f"{view.placement.source}: no pose of the board fits its corners; check that the image is not"
        " mirrored and that the board is the one in the rig file"
    )
    if known.sum() < FEWEST_CORNERS:
        raise mistake
    found, turn, shift = cv2.solvePnP(points, directions[known], np.eye(3), None, flags=cv2.SOLVEPNP_IPPE)
    axes = cv2.Rodrigues(turn)[0]
    if not found or axes[2, 2] <= 0:
        raise mistake
    slope_x, slope_y = float(-axes[0, 2] / axes[2, 2]), float(-axes[1, 2] / axes[2, 2])
    across = np.array([1.0, 0.0, slope_x]) / np.hypot(1.0, slope_x)
    roll = atan2(float(axes[:, 0] @ np.cross(axes[:, 2], across)), float(axes[:, 0] @ across))
    x, y, z = (float(one) for one in shift[:, 0])
    return PoseGuess(slope_x, slope_y, x, y, roll, z - slope_x * x - slope_y * y, z)
