"""Which laser made which spot, when several are lit at once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import permutations

import numpy as np

from workbench.model.arrays import FloatArray, IndexArray
from workbench.model.stats import chi2_sf
from workbench.sensor.calibrated import CalibratedSensor, RangeEstimates

MOST_MISFIT_SD = 6.0
"""A spot farther from a laser's line is not that laser's: by chance one in 5e8 is."""
IMPROBABLE = 1e-4
"""Chance of distances from the lines as large as these, below which a way of dealing is out."""
CLEARLY_BETTER = 2.0
"""The best way is believed when the spread of the next best is this many times larger."""
SMOOTH = 0.05
"""Where spots are missing: the largest relative spread of inverse depths that is taken for one surface."""
FEWEST_FOR_SMOOTH = 3
"""Two spots lie on some surface whichever lasers made them."""
MOST_LASERS = 6


@dataclass(frozen=True)
class Pairs:
    """What each of L lasers would make of each of S spots."""

    ranges: RangeEstimates
    """Of the L x S pairs, row by row: laser 0 with every spot, laser 1, ..."""
    inverse_depth: FloatArray
    """(L, S) not positive where the laser cannot have made the spot."""
    misfit_sd: FloatArray
    """(L, S)"""

    def chosen(self, lasers: IndexArray, spots: IndexArray) -> RangeEstimates:
        """Ranges of some pairs."""
        return self.ranges.only(lasers * self.misfit_sd.shape[1] + spots)


def pair_up(sensor: CalibratedSensor, position_px: FloatArray, sd_px: FloatArray) -> Pairs:
    """Range every spot as if every laser had made it.

    Args:
        sensor: the calibrated sensor.
        position_px: (S, 2) u, v of the spots.
        sd_px: (S, 2) their 1 sigma.
    """
    lasers, spots = len(sensor.ids), len(position_px)
    laser, spot = np.divmod(np.arange(lasers * spots), max(spots, 1))
    ranges = sensor.ranges_of(laser, position_px[spot], sd_px[spot])
    inverse_depth = (1.0 / (ranges.range_mm + sensor.offset_mm)).reshape(lasers, spots)
    possible = (inverse_depth > 0) & (ranges.range_mm.reshape(lasers, spots) > 0)
    misfit = ranges.misfit_sd.reshape(lasers, spots)
    return Pairs(ranges, np.where(possible, inverse_depth, -1.0), np.where(possible, misfit, np.inf))


def assign(pairs: Pairs, lasers: IndexArray) -> tuple[IndexArray, IndexArray] | None:
    """Indices of lasers and of the spots that they made, equally many; None where the spots do not tell.

    Spots that lie off the line of every laser are other light. Each way of dealing the others to the lasers
    puts them at distances from the lasers' lines and at inverse depths. Ways in which the distances are
    improbable are out: the lines of real lasers, which are never quite coplanar, are often enough. Of the
    rest, a surface that does not jump gives all lasers about the same inverse depth and a swap of two does
    not, neighbouring baselines differing by half and more: the way with the smallest relative spread is
    taken, if it is clearly so. Where spots are missing, the spread must be small, too. What remains
    undecided, or wrong, is a target that jumps in depth as far as a swap would make it, seen by lasers whose
    lines coincide.

    Args:
        pairs: of all lasers with all spots.
        lasers: (n,) indices of the lasers of one line that are lit.
    """
    on_line = pairs.misfit_sd[lasers] < MOST_MISFIT_SD
    spots = np.flatnonzero(on_line.any(axis=0))
    n, m = len(lasers), len(spots)
    if m > n or n > MOST_LASERS:
        return None
    if m == 0:
        return lasers[:0], spots
    ways = _ways(n, m)
    to, columns = lasers[ways], spots[None, :]
    dealt = pairs.inverse_depth[to, columns]
    misfit2 = (pairs.misfit_sd[to, columns] ** 2).sum(axis=1)
    possible = (dealt > 0).all(axis=1) & (misfit2 < MOST_MISFIT_SD**2 * m)
    possible[possible] = chi2_sf(misfit2[possible], m) > IMPROBABLE
    left = np.flatnonzero(possible)
    if len(left) == 0:
        return None
    if len(left) == 1:
        return to[left[0]], spots
    spread = dealt[left].std(axis=1) / dealt[left].mean(axis=1)
    best, next_best = np.partition(spread, 1)[:2]
    smooth = m == n or (m >= FEWEST_FOR_SMOOTH and best < SMOOTH < next_best)
    if next_best < CLEARLY_BETTER * best or not smooth:
        return None
    return to[left[spread.argmin()]], spots


@lru_cache(maxsize=64)
def _ways(lasers: int, spots: int) -> IndexArray:
    """(ways, spots) every way of giving each spot a laser of its own."""
    return np.array(list(permutations(range(lasers), spots)), np.intp)
