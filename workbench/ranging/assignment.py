"""Assignment of spots to lasers when several are on at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.model.arrays import FloatArray, IndexArray
from workbench.model.stats import chi2_sf
from workbench.sensor.calibrated import CalibratedSensor
from workbench.sensor.range_model import RangeEstimates

MOST_MISFIT_SD = 6.0
"""Largest distance of a spot from its laser's line; 1 in 5e8 lies farther by chance."""
IMPROBABLE = 1e-4
"""P value of the distances from the lines below which an assignment is rejected."""
CLEARLY_BETTER = 2.0
"""Ratio of the spread of the second best assignment to that of the best from which the best is accepted."""
SMOOTH = 0.05
"""Largest relative spread of inverse depths on one surface, where spots are missing."""
FEWEST_FOR_SMOOTH = 3
"""Least number of spots for that test: two lie on some surface in any assignment."""
MOST_ASSIGNMENTS = 720
"""Largest number of assignments that are compared: those of six lasers on one line."""


@dataclass(frozen=True)
class LaserSpotPairs:
    """Range estimates of all pairs of L lasers and S spots."""

    ranges: RangeEstimates
    """Of the L x S pairs, row by row: laser 0 with every spot, laser 1, ..."""
    inverse_depth: FloatArray
    """(L, S) not positive where the pair is impossible."""
    misfit_sd: FloatArray
    """(L, S) distance of the spot from the laser's line; infinite where the pair is impossible."""

    def chosen(self, lasers: IndexArray, spots: IndexArray) -> RangeEstimates:
        """Ranges of the pairs of lasers (n,) and spots (n,)."""
        return self.ranges.only(lasers * self.misfit_sd.shape[1] + spots)


def pair_up(
    sensor: CalibratedSensor,
    position_px: FloatArray,
    sd_px: FloatArray,
    speckle_sd_px: FloatArray | None = None,
) -> LaserSpotPairs:
    """Range every spot with every laser.

    Args:
        sensor: the calibrated sensor.
        position_px: (S, 2) u, v of the spots.
        sd_px: (S, 2) their 1 sigma by noise.
        speckle_sd_px: (S, 2) their 1 sigma by speckle; None: that of the calibration.
    """
    lasers, spots = len(sensor.ids), len(position_px)
    laser, spot = np.divmod(np.arange(lasers * spots), max(spots, 1))
    speckle = None if speckle_sd_px is None else speckle_sd_px[spot]
    ranges = sensor.ranges_of(laser, position_px[spot], sd_px[spot], speckle)
    inverse_depth = (1.0 / (ranges.range_mm + sensor.offset_mm)).reshape(lasers, spots)
    possible = (inverse_depth > 0) & (ranges.range_mm.reshape(lasers, spots) > 0)
    misfit = ranges.misfit_sd.reshape(lasers, spots)
    return LaserSpotPairs(ranges, np.where(possible, inverse_depth, -1.0), np.where(possible, misfit, np.inf))


def assign(pairs: LaserSpotPairs, lasers: IndexArray) -> tuple[IndexArray, IndexArray] | None:
    """Indices of lasers and of their spots, equally many; None where the assignment is ambiguous.

    Spots off the lines of all lasers are other light. Every injective assignment of the other spots to lasers
    on whose lines they lie is enumerated. Assignments with improbable distances from the lasers' lines are
    rejected; this is often sufficient, because the lines of real lasers are never quite coplanar. Of the
    rest, the assignment with the smallest relative spread of inverse depths is taken, if the second best is
    clearly worse. On a
    surface without jumps all lasers have nearly the same inverse depth; exchanging two of them changes it
    by half and more, the ratio of neighbouring baselines. Where spots are missing, the spread must also be
    small. For lasers with coincident lines, a jump in depth as large as an exchange would cause gives an
    undecided or wrong result.

    Args:
        pairs: of all lasers with all spots.
        lasers: (n,) indices of the lasers of one row that are on.
    """
    from workbench.ranging.assignment_kernels import assignments  # loads the compiler

    on_line = pairs.misfit_sd[lasers] < MOST_MISFIT_SD
    spots = np.flatnonzero(on_line.any(axis=0))
    n, m = len(lasers), len(spots)
    if m > n:
        return None
    if m == 0:
        return lasers[:0], spots
    found = assignments(on_line[:, spots], MOST_ASSIGNMENTS)
    if len(found) > MOST_ASSIGNMENTS:
        return None
    to, columns = lasers[found], spots[None, :]
    inverse_depth = pairs.inverse_depth[to, columns]
    misfit2 = (pairs.misfit_sd[to, columns] ** 2).sum(axis=1)
    possible = (inverse_depth > 0).all(axis=1) & (misfit2 < MOST_MISFIT_SD**2 * m)
    possible[possible] = chi2_sf(misfit2[possible], m) > IMPROBABLE
    remaining = np.flatnonzero(possible)
    if len(remaining) == 0:
        return None
    if len(remaining) == 1:
        return to[remaining[0]], spots
    spread = inverse_depth[remaining].std(axis=1) / inverse_depth[remaining].mean(axis=1)
    best, next_best = np.partition(spread, 1)[:2]
    smooth = m == n or (m >= FEWEST_FOR_SMOOTH and best < SMOOTH < next_best)
    if next_best < CLEARLY_BETTER * best or not smooth:
        return None
    return to[remaining[spread.argmin()]], spots
