"""The printed board at a placement: its corners in the image, and a first guess of its pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import atan2
from typing import TYPE_CHECKING

import numpy as np

from workbench.calibration.data.observations import MeanObservations, Observation, PlacementInfo, Rejected
from workbench.model.board import Board
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig
from workbench.optics.lens_models import lens_model
from workbench.optics.undistort import undistort

# OpenCV is imported where there is a board: a fit of spots alone starts without it.
if TYPE_CHECKING:
    from workbench.corners.board import BoardCorners
    from workbench.model.arrays import Image

FEWEST_CORNERS = 4
"""That determine a pose."""
BAND_EDGE_MM = 3.0
"""A spot's middle must lie this far inside the band: beams are some 2.5 mm wide where a board is read."""


@dataclass(frozen=True)
class BoardView:
    """What was seen of the board at one placement."""

    placement: PlacementInfo
    corners: BoardCorners


@dataclass(frozen=True)
class PoseGuess:
    """The board's pose by the rig file's lens: a start for the fit, some millimetres and degrees off."""

    slope_x: float
    slope_y: float
    x_mm: float
    y_mm: float
    roll_rad: float


def see_board(frames: Sequence[Image], board: Board, placement: PlacementInfo) -> BoardView | Rejected:
    """The board in frames of one placement, or why it is not found."""
    from workbench.corners.board import find_board

    try:
        return BoardView(placement, find_board(frames, board))
    except BadInputError as error:
        return Rejected(placement.source, f"board at {placement.standoff_mm:g} mm: {error}")


def on_band(view: BoardView, board: Board, observation: Observation) -> Observation | Rejected:
    """The observation of a spot, or its rejection where it lies on the print or beside the board.

    The spot's place on the board comes from the corners around it; lens distortion over their distance
    shifts it by less than a millimetre.
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
    board: Board, seen: Mapping[str, BoardView | Rejected], found: Sequence[Observation | Rejected]
) -> list[Observation | Rejected]:
    """What was found of spots, without those that a board as their target spoils.

    Args:
        board: the board.
        seen: by placement, what was seen of the board where it was the target.
        found: observations of any placement, and what was rejected already.
    """
    return [_on_board(board, seen.get(f.placement), f) if isinstance(f, Observation) else f for f in found]


def _on_board(
    board: Board, seen: BoardView | Rejected | None, observation: Observation
) -> Observation | Rejected:
    if seen is None:
        return observation
    if isinstance(seen, BoardView):
        return on_band(seen, board, observation)
    where = f"laser {observation.laser_id} at {observation.standoff_mm:g} mm"
    return Rejected(observation.source, f"{where}: the board that it fell on was not found")


def with_placements(cells: MeanObservations, boards: Sequence[BoardView]) -> MeanObservations:
    """The cells with the boards' placements among theirs.

    Raises:
        BadInputError: two boards at one placement, or a board and a spot that say different things of it.
    """
    known = {p.key: p for p in cells.placements}
    seen: set[str] = set()
    for view in boards:
        mine = view.placement
        first = known.setdefault(mine.key, mine)
        if mine.key in seen or first.told != mine.told:
            raise BadInputError(
                f"{mine.source}: standoff_mm: expected what {first.source} says of the same placement"
                f" {mine.key} ({first.describe}) and one board, got {mine.describe}; give other placements"
                " other names"
            )
        seen.add(mine.key)
    return replace(cells, placements=tuple(known.values()))


def guess_pose(rig: Rig, view: BoardView) -> PoseGuess:
    """The pose that fits the corners best with the rig file's lens.

    Raises:
        BadInputError: no pose does.
    """
    import cv2

    lens = np.array([prior.value for prior in rig.camera.lens_priors.values()])
    sight = undistort(lens_model(rig.camera.lens), lens, view.corners.position_px)
    shown = np.isfinite(sight).all(axis=1)
    printed = rig.board.corners_mm[view.corners.ids][shown]
    points = np.column_stack([printed, np.zeros(len(printed))])
    mistake = BadInputError(
        f"{view.placement.source}: the board's corners fit no pose; is the image mirrored, or the board"
        " not the one of the rig file?"
    )
    if shown.sum() < FEWEST_CORNERS:
        raise mistake
    found, turn, shift = cv2.solvePnP(points, sight[shown], np.eye(3), None, flags=cv2.SOLVEPNP_IPPE)
    axes = cv2.Rodrigues(turn)[0]
    if not found or axes[2, 2] <= 0:
        raise mistake
    slope_x, slope_y = float(-axes[0, 2] / axes[2, 2]), float(-axes[1, 2] / axes[2, 2])
    across = np.array([1.0, 0.0, slope_x]) / np.hypot(1.0, slope_x)
    roll = atan2(float(axes[:, 0] @ np.cross(axes[:, 2], across)), float(axes[:, 0] @ across))
    return PoseGuess(slope_x, slope_y, float(shift[0, 0]), float(shift[1, 0]), roll)
