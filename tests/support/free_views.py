"""Views of a chessboard held anywhere, made by OpenCV's lens: independent of `workbench.optics`."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from workbench.calibration.data.boards import BoardView
from workbench.calibration.data.observations import PlacementInfo
from workbench.corners.board import BoardCorners
from workbench.model.arrays import FloatArray
from workbench.model.known_board import Chessboard
from workbench.model.prior import Prior
from workbench.model.rig import BenchSpec, CameraSpec, Rig

BOARD = Chessboard(kind="chessboard", corners=(9, 6), square_mm=25.0)
RIG = Rig(
    format=1,
    rig="camera",
    camera=CameraSpec(
        width_px=640,
        height_px=480,
        f_px=Prior(value=500.0, sd=150.0),
        cx_px=Prior(value=319.5, sd=20.0),
        cy_px=Prior(value=239.5, sd=20.0),
        k1=Prior(value=0.0, sd=0.3),
        k2=Prior(value=0.0, sd=0.3),
        p1=Prior(value=0.0, sd=0.002),
        p2=Prior(value=0.0, sd=0.002),
    ),
    bench=BenchSpec(board_flatness_sd_mm=0.1, print_scale=Prior(value=0.0, sd=0.001)),
    board=BOARD,
)
TRUTH = {"f_px": 540.0, "cx_px": 331.0, "cy_px": 228.0, "k1": -0.25, "k2": 0.08, "p1": 0.001, "p2": -0.0005}


Project = Callable[[FloatArray], FloatArray]
"""Pixels (n, 2) of points (n, 3) in the camera's frame, mm."""


def project(points_mm: FloatArray) -> FloatArray:
    """Pixels by OpenCV's lens with TRUTH."""
    k = np.array([[TRUTH["f_px"], 0, TRUTH["cx_px"]], [0, TRUTH["f_px"], TRUTH["cy_px"]], [0, 0, 1]])
    lens = np.array([TRUTH[name] for name in ("k1", "k2", "p1", "p2")])
    return np.asarray(cv2.projectPoints(points_mm, np.zeros(3), np.zeros(3), k, lens)[0], float).reshape(
        -1, 2
    )


def views(
    count: int, seed: int, sd_px: float = 0.1, stated_px: float | None = None, by: Project = project
) -> list[BoardView]:
    """Views `V1`, `V2`, ... with tilts of up to some 35 degrees, each of the whole board."""
    rng = np.random.default_rng(seed)
    printed = np.column_stack([BOARD.corners_mm, np.zeros(len(BOARD.corners_mm))])
    found: list[BoardView] = []
    while len(found) < count:
        turn = cv2.Rodrigues(rng.uniform(-0.6, 0.6, 3))[0]
        shift = rng.uniform([-80.0, -60.0, 300.0], [80.0, 60.0, 600.0])
        seen = by(printed @ turn.T + shift)
        if not ((seen > 8).all() and (seen < [631, 471]).all()):
            continue
        name = f"V{len(found) + 1}"
        noisy = seen + rng.normal(0.0, sd_px, seen.shape)
        sd = np.full(seen.shape, sd_px if stated_px is None else stated_px)
        info = PlacementInfo(name, float("nan"), float("nan"), 0.0, name)
        found.append(BoardView(info, BoardCorners(np.arange(len(seen)), noisy, sd, 0)))
    return found
