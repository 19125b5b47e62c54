"""Blooming: charge of clipped pixels that has spilled along the columns of the sensor.

A clipped spot without blooming is about as long as wide. With it the clipped pixels form a streak along the
column. The spot may be anywhere in the streak: its share of the charge that ran up and down is not known.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from workbench.model.arrays import BoolArray, Image
from workbench.model.spot import Failure, Spot

# Length over width from which clipped pixels are a streak, and the least excess, px: spots are not round, and
# short runs are coarse.
_STREAK_RATIO: Final = 1.25
_LEAST_EXCESS_PX: Final = 2
# Deviation of the middle of a streak's widest row, px.
_MIDDLE_SD_PX: Final = 0.3
# Half width of the columns in which a streak is looked for, px.
_REACH_PX: Final = 3


def with_blooming(spot: Spot, on: Image, clip_dn: float) -> Spot:
    """The spot, flagged and with wider deviations where its clipped pixels form a streak.

    Args:
        spot: spot that was measured in the frame.
        on: frame with the laser on.
        clip_dn: value of a clipped pixel.
    """
    if Failure.SATURATED not in spot.flags:
        return spot
    row, column = round(spot.v_px), round(spot.u_px)
    left = max(column - _REACH_PX, 0)
    clipped = on[:, left : column + _REACH_PX + 1] >= clip_dn
    runs = [_run(clipped[:, n], row) for n in range(clipped.shape[1])]
    start, stop = max(runs, key=lambda run: run[1] - run[0])
    length = stop - start
    if length == 0:
        return spot
    # The widest row of the streak is the spot's own.
    across = [_run(line, column) for line in on[start:stop] >= clip_dn]
    left, right = max(across, key=lambda run: run[1] - run[0])
    excess_px = length - (right - left)
    if length < _STREAK_RATIO * (right - left) or excess_px < _LEAST_EXCESS_PX:
        return spot
    # Along the column the spot may be anywhere in the streak, and its fit at either end.
    off_u, off_v = spot.u_px - (left + right - 1) / 2, spot.v_px - (start + stop - 1) / 2
    return replace(
        spot,
        u_sd_px=math.hypot(spot.u_sd_px, off_u, _MIDDLE_SD_PX),
        v_sd_px=math.hypot(spot.v_sd_px, off_v, excess_px / math.sqrt(12.0)),
        flags=spot.flags | {Failure.BLOOMING},
    )


def _run(clipped: BoolArray, near: int) -> tuple[int, int]:
    """Start and stop of the run of clipped pixels at or near an index; 0, 0 without one."""
    around = (near, near - 1, near + 1, near - 2, near + 2)
    there = [n for n in around if 0 <= n < len(clipped) and clipped[n]]
    if not there:
        return 0, 0
    free = np.flatnonzero(~clipped)
    before, after = free[free < there[0]], free[free > there[0]]
    return (int(before[-1]) + 1 if len(before) else 0), (int(after[0]) if len(after) else len(clipped))
