"""Optimal design of standoffs, before any data.

To first order the information of spots on the parameters depends on the sensor, not on the measured
positions. It differs between sensors: the stronger the distortion, the better its centre is determined. So
the design is computed for many sensors drawn from the rig's tolerances, and the median sensor counts.

The criterion is the worst relative sd of a range, by the calibration and by the noise of the ranged spot
together. That noise is the same for every design, but determines which range is the worst.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from workbench.calibration.design.expectation import Expectation
from workbench.calibration.model.parameters import ParameterTable, sensor_parameters
from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.errors import BadInputError
from workbench.model.rig import NoiseSpec, Rig

RANGES_MM = np.geomspace(100.0, 5000.0, 18)
DRAWS = 256
SEARCH_DRAWS = 64
"""Number of sensors in the search; enough, because all designs are ranked by the same sensors."""
SEED = 2001
CANDIDATES = 45
"""Candidate standoffs, evenly spaced in their logarithm: 9 % apart over a reach of 0.1 to 5 m."""
ROUNDS = 6
"""Largest number of exchange rounds; two or three are usual."""
LEAST_GAIN = 1e-4
"""Least relative decrease of the cost for an exchange of standoffs."""
SPARED = 0.01
"""Relative increase of the worst range that the second exchange may spend on all other ranges."""
Cost = Callable[[FloatArray], FloatArray]
"""(C,) from the relative variance of ranges (N, C, K)."""


class RangeGoals(NamedTuple):
    """K ranges (of all lasers) whose uncertainty counts, for N sensors with F free parameters in prior sd."""

    by_parameter: FloatArray
    """(N, K, F) derivatives of ln(range); 0 where the spot is outside the image."""
    spot_sd: FloatArray
    """(N, K) relative sd by the noise of the ranged spot; 0 where the spot is outside the image."""

    @classmethod
    def of(cls, expectation: Expectation, range_mm: FloatArray, noise: NoiseSpec) -> RangeGoals:
        """Ranges (R,) of each laser, by single spots."""
        rows, own = expectation.range_rows(range_mm, mean_sd_px(noise, 1))
        flat = rows[..., expectation.table.free].reshape(len(rows), own[0].size, -1)
        return cls(np.nan_to_num(flat), np.nan_to_num(own).reshape(len(rows), -1))

    def total(self, by_calibration: FloatArray) -> FloatArray:
        """(N, ..., K) relative variance of ranges, from the part by the calibration (N, ..., K)."""
        own = self.spot_sd.reshape(len(self.spot_sd), *(1,) * (by_calibration.ndim - 2), -1)
        return np.asarray(by_calibration + own**2)

    def variance(self, covariance: FloatArray) -> FloatArray:
        """(N, K) relative variance of ranges by a calibration with covariance (N, F, F)."""
        return np.asarray(((self.by_parameter @ covariance) * self.by_parameter).sum(axis=-1))


@dataclass(frozen=True)
class Candidates:
    """C candidate standoffs, with the information of a placement at each for N sensors."""

    standoff_mm: FloatArray
    """(C,)"""
    rows: FloatArray
    """(N, C, M, F) whitened derivatives, see `Expectation.spot_rows`."""
    goals: RangeGoals

    @classmethod
    def of(
        cls, expectation: Expectation, standoff_mm: FloatArray, repeats: int, goals: RangeGoals
    ) -> Candidates:
        """Placements with `repeats` captures of each laser."""
        rows = expectation.spot_rows(standoff_mm, mean_sd_px(expectation.rig.noise, repeats))
        return cls(standoff_mm, rows[..., expectation.table.free], goals)

    def covariance(self, chosen: Sequence[int]) -> FloatArray:
        """(N, F, F) posterior after a placement at each of the chosen standoffs."""
        return posterior(self.rows[:, list(chosen)])

    def worst(self, chosen: Sequence[int]) -> float:
        """The criterion."""
        return float(worst_of(self.goals.total(self.goals.variance(self.covariance(chosen)))))

    def worst_with_one_more(self, covariance: FloatArray) -> FloatArray:
        """(C,) the criterion after one more placement at each candidate, from a covariance (N, F, F)."""
        return worst_of(self.with_one_more(covariance))

    def with_one_more(self, covariance: FloatArray) -> FloatArray:
        """(N, C, K) relative variance of ranges after one more placement at each candidate.

        A rank-M update of the covariance P (N, F, F) (Sherman, Morrison, Woodbury), for the range gradients g
        only: `g P' g = g P g - |L^-1 A P g|^2` with `A P A^T + 1 = L L^T`.
        """
        projected = self.rows @ covariance[:, None]
        noise = projected @ np.swapaxes(self.rows, 2, 3) + np.eye(self.rows.shape[2])
        by_range = projected @ np.swapaxes(self.goals.by_parameter, 1, 2)[:, None]
        gained = (np.linalg.solve(np.linalg.cholesky(noise), by_range) ** 2).sum(axis=2)
        return self.goals.total(self.goals.variance(covariance)[:, None] - gained)


def posterior(rows: FloatArray) -> FloatArray:
    """(N, F, F) covariance in units of the priors, from whitened rows (N, J, M, F)."""
    flat = rows.reshape(len(rows), rows.shape[1] * rows.shape[2], rows.shape[3])
    return np.asarray(np.linalg.inv(np.swapaxes(flat, 1, 2) @ flat + np.eye(rows.shape[-1])))


def worst_of(variance: FloatArray) -> FloatArray:
    """(...) largest relative sd over all K ranges, of the median sensor, from variances (N, ..., K)."""
    return np.asarray(np.median(np.sqrt(np.maximum(variance, 0.0).max(axis=-1)), axis=0))


def typical_of(variance: FloatArray, seen: BoolArray) -> FloatArray:
    """(C,) geometric mean of the relative sd over the ranges seen (N, K), from variances (N, C, K)."""
    logs = np.log(variance, out=np.zeros_like(variance), where=np.broadcast_to(seen[:, None], variance.shape))
    return np.asarray(np.exp(0.5 * logs.sum(axis=(0, 2)) / max(int(seen.sum()), 1)))


def mean_sd_px(noise: NoiseSpec, repeats: int) -> float:
    """1 sigma of the mean of repeats, in either coordinate, px; repeats share their speckle."""
    return float(np.hypot(noise.spot_sd_px / np.sqrt(repeats), noise.speckle_sd_px))


def best_standoffs(rig: Rig, count: int, repeats: int) -> tuple[float, ...]:
    """Standoffs within the rig's reach that minimise the worst relative range sd from 0.1 to 5 m.

    Raises:
        BadInputError: fewer than `count` candidates have a spot in the image.
    """
    sensors = drawn_sensors(rig, SEARCH_DRAWS)
    goals = RangeGoals.of(sensors, RANGES_MM, rig.noise)
    return propose(Candidates.of(sensors, candidate_standoffs(rig), repeats, goals), count)


def drawn_sensors(rig: Rig, draws: int = DRAWS) -> Expectation:
    """Sensors drawn from the rig's priors, in antithetic pairs about the prior means."""
    table = ParameterTable(sensor_parameters(rig))
    half = np.random.default_rng(SEED).standard_normal((draws // 2, len(table.prior_mean)))
    return Expectation(rig, table.prior_mean + table.prior_sd * np.concatenate([half, -half]))


def candidate_standoffs(rig: Rig) -> FloatArray:
    """(C,) standoffs within reach, rounded to two significant digits except the ends."""
    nearest, farthest = rig.bench.reach_mm
    grid = np.geomspace(nearest, farthest, CANDIDATES)
    digits = 10.0 ** (np.floor(np.log10(grid)) - 1)
    return np.unique(np.clip(np.round(grid / digits) * digits, nearest, farthest))


def propose(candidates: Candidates, count: int) -> tuple[float, ...]:
    """Standoffs that minimise the criterion locally, by greedy selection and then exchanges.

    At far ranges the noise of the ranged spot dominates the worst range, and many designs are nearly as good
    as the best. So a second exchange minimises the typical range uncertainty among designs whose criterion
    is within `SPARED` of the best.

    The exchange algorithm is that of V. V. Fedorov, "Theory of Optimal Experiments" (1972), with another
    criterion.

    Raises:
        BadInputError: `count` is below 1 or larger than the number of candidates with a spot in the image.
    """
    if count < 1:
        raise BadInputError(f"--count: expected at least 1, got {count}")
    seen = (candidates.rows != 0).any(axis=(2, 3)).mean(axis=0) > 0.5
    if seen.sum() < count:
        raise BadInputError(
            f"--count: expected at most {int(seen.sum())}, got {count}: of {len(seen)} standoffs within"
            f" bench.reach_mm, {int(seen.sum())} have a spot in the image"
        )
    chosen: list[int] = []
    for _ in range(count):
        chosen.append(_best(candidates, chosen, seen, worst_of)[0])
    chosen = _exchanged(candidates, chosen, seen, worst_of)
    limit = candidates.worst(chosen) * (1 + SPARED)

    def typical(variance: FloatArray) -> FloatArray:
        return np.where(
            worst_of(variance) <= limit, typical_of(variance, candidates.goals.spot_sd > 0), np.inf
        )

    return tuple(sorted(candidates.standoff_mm[_exchanged(candidates, chosen, seen, typical)].tolist()))


def _exchanged(candidates: Candidates, chosen: list[int], allowed: BoolArray, cost: Cost) -> list[int]:
    """The chosen candidates, each exchanged for another while that lowers the cost."""
    reached = np.inf
    for _ in range(ROUNDS):
        before = reached
        for place in range(len(chosen)):
            rest = [*chosen[:place], *chosen[place + 1 :]]
            best, cheapest = _best(candidates, rest, allowed, cost)
            if cheapest < reached * (1 - LEAST_GAIN):
                chosen, reached = [*rest[:place], best, *rest[place:]], cheapest
        if reached == before:
            break
    return chosen


def _best(candidates: Candidates, chosen: Sequence[int], allowed: BoolArray, cost: Cost) -> tuple[int, float]:
    """The candidate that, added to the chosen ones, has the least cost, and that cost."""
    costs = np.where(allowed, cost(candidates.with_one_more(candidates.covariance(chosen))), np.inf)
    costs[list(chosen)] = np.inf
    best = int(costs.argmin())
    return best, float(costs[best])
