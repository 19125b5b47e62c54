"""Which laser made which spot, when several are lit at once."""

from __future__ import annotations

from itertools import permutations
from math import factorial

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from workbench.calibration.sensor import Sensor

FloatArray = NDArray[np.float64]
CLEARLY_BETTER = 2.0
"""The best assignment is believed when the spread of the next best is this many times larger."""
IMPROBABLE = 1e-4
"""Chance of distances from the lines as large as these, below which a way of dealing is out."""
MOST_LASERS = 6


def assign(sensor: Sensor, position_px: FloatArray, sd_px: FloatArray) -> tuple[str, ...] | None:
    """Laser ids of n spots, n the number of lasers; None where the spots do not tell.

    Each way of dealing the spots to the lasers puts each spot at a distance from its laser's line and at an
    inverse depth. Ways in which the distances are improbable are out: the lines of real lasers, which are
    never quite coplanar, are often enough. Of the rest, a surface that does not jump gives all lasers about
    the same inverse depth and a swap of two does not, neighbouring baselines differing by half and more: the
    way with the smallest relative spread is taken, if it is clearly so. What remains undecided, or wrong, is
    a target that jumps in depth as far as a swap would make it, seen by lasers whose lines coincide.

    Args:
        sensor: the calibrated sensor.
        position_px: (n, 2) u, v of the spots, in any order.
        sd_px: (n, 2) their 1 sigma.
    """
    ids = sensor.ids
    n = len(ids)
    if len(position_px) != n or n > MOST_LASERS:
        return None
    every_laser = [i for i in ids for _ in range(n)]
    ranges = sensor.ranges(every_laser, np.tile(position_px, (n, 1)), np.tile(sd_px, (n, 1)))
    inverse_depth = (1.0 / (ranges.range_mm + sensor.offset_mm)).reshape(n, n)  # [laser, spot]
    misfit = ranges.misfit_sd.reshape(n, n)
    ways = np.array(list(permutations(range(n)))).reshape(factorial(n), n)
    dealt = inverse_depth[np.arange(n), ways]
    on_line = chdtrc(n, (misfit[np.arange(n), ways] ** 2).sum(axis=1)) > IMPROBABLE
    possible = (dealt > 0).all(axis=1) & on_line
    if not possible.any():
        return None
    ways, dealt = ways[possible], dealt[possible]
    spread = dealt.std(axis=1) / dealt.mean(axis=1)
    order = np.argsort(spread)
    if len(order) > 1 and spread[order[1]] < CLEARLY_BETTER * spread[order[0]]:
        return None
    assigned = [""] * n
    for laser, spot in zip(ids, ways[order[0]], strict=True):
        assigned[spot] = laser
    return tuple(assigned)
