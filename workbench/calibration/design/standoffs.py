"""Design of standoffs: what a calibration will determine, before any data, and where to place the target.

To first order what spots tell of the parameters depends on the sensor, not on the spots' noise. It matters
which sensor it is: the more a lens bends, the better its centre shows. So everything is worked out for many
sensors drawn from the rig's tolerances, and told of the median one.

The criterion is the worst relative sd of a range, by the calibration and the noise of the spot that is ranged
together. That noise is the same with every design, but it says which range is the worst.
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
"""Enough to rank designs by: all are ranked by the same sensors."""
SEED = 2001
CANDIDATES = 45
"""Standoffs to choose from, evenly spaced in their logarithm: 9 % apart over a reach of 0.1 to 5 m."""
ROUNDS = 6
"""Of exchanges, at most; two or three do."""
WORTH = 1e-4
"""Relative gain for which one standoff is exchanged for another."""
SPARED = 0.01
"""Of the worst range, for the sake of all others."""
Cost = Callable[[FloatArray], FloatArray]
"""(C,) from the relative variance of ranges (N, C, K)."""


class Aim(NamedTuple):
    """Ranges to be good at, for N sensors: K of them, of every laser. F free parameters, in prior sd."""

    by_parameter: FloatArray
    """(N, K, F) derivatives of ln(range); 0 where the spot is out of frame."""
    spot_sd: FloatArray
    """(N, K) relative sd by the noise of the spot that is ranged; 0 likewise."""

    @classmethod
    def of(cls, expectation: Expectation, range_mm: FloatArray, noise: NoiseSpec) -> Aim:
        """Ranges (R,) of each laser, by single spots."""
        rows, own = expectation.range_rows(range_mm, mean_sd_px(noise, 1))
        flat = rows[..., expectation.table.free].reshape(len(rows), own[0].size, -1)
        return cls(np.nan_to_num(flat), np.nan_to_num(own).reshape(len(rows), -1))

    def total(self, by_calibration: FloatArray) -> FloatArray:
        """(N, ..., K) relative variance of ranges, from that which the calibration causes."""
        own = self.spot_sd.reshape(len(self.spot_sd), *(1,) * (by_calibration.ndim - 2), -1)
        return np.asarray(by_calibration + own**2)

    def variance(self, covariance: FloatArray) -> FloatArray:
        """(N, K) relative variance of ranges that a calibration with covariance (N, F, F) causes."""
        return np.asarray(((self.by_parameter @ covariance) * self.by_parameter).sum(axis=-1))


@dataclass(frozen=True)
class Choice:
    """Standoffs to choose from, and what a placement at each tells N sensors."""

    standoff_mm: FloatArray
    """(C,)"""
    rows: FloatArray
    """(N, C, M, F) whitened, see `Expectation.spot_rows`."""
    aim: Aim

    @classmethod
    def of(cls, expectation: Expectation, standoff_mm: FloatArray, repeats: int, aim: Aim) -> Choice:
        """Placements with `repeats` readings of each laser."""
        rows = expectation.spot_rows(standoff_mm, mean_sd_px(expectation.rig.noise, repeats))
        return cls(standoff_mm, rows[..., expectation.table.free], aim)

    def covariance(self, chosen: Sequence[int]) -> FloatArray:
        """(N, F, F) posterior after a placement at each of the chosen standoffs."""
        return posterior(self.rows[:, list(chosen)])

    def worst(self, chosen: Sequence[int]) -> float:
        """The criterion."""
        return float(worst_of(self.aim.total(self.aim.variance(self.covariance(chosen)))))

    def worst_with_one_more(self, covariance: FloatArray) -> FloatArray:
        """(C,) the criterion with a placement at each candidate more than gave the covariance (N, F, F)."""
        return worst_of(self.with_one_more(covariance))

    def with_one_more(self, covariance: FloatArray) -> FloatArray:
        """(N, C, K) relative variance of ranges with a placement at each candidate more.

        A rank-M update of the covariance (N, F, F) (Sherman, Morrison and Woodbury) of which only the ranges
        are worked out.
        """
        told = self.rows @ covariance[:, None]
        noise = told @ np.swapaxes(self.rows, 2, 3) + np.eye(self.rows.shape[2])
        by_range = told @ np.swapaxes(self.aim.by_parameter, 1, 2)[:, None]
        gained = (np.linalg.solve(np.linalg.cholesky(noise), by_range) ** 2).sum(axis=2)
        return self.aim.total(self.aim.variance(covariance)[:, None] - gained)


def posterior(rows: FloatArray) -> FloatArray:
    """(N, F, F) covariance in units of the priors, from whitened rows (N, J, M, F)."""
    flat = rows.reshape(len(rows), rows.shape[1] * rows.shape[2], rows.shape[3])
    return np.asarray(np.linalg.inv(np.swapaxes(flat, 1, 2) @ flat + np.eye(rows.shape[-1])))


def worst_of(variance: FloatArray) -> FloatArray:
    """(...) of (N, ..., K): the largest relative sd over all ranges, of the median sensor."""
    return np.asarray(np.median(np.sqrt(np.maximum(variance, 0.0).max(axis=-1)), axis=0))


def typical_of(variance: FloatArray, seen: BoolArray) -> FloatArray:
    """(C,) of (N, C, K): geometric mean of the relative sd over all ranges that are seen (N, K)."""
    logs = np.log(variance, out=np.zeros_like(variance), where=np.broadcast_to(seen[:, None], variance.shape))
    return np.asarray(np.exp(0.5 * logs.sum(axis=(0, 2)) / max(int(seen.sum()), 1)))


def mean_sd_px(noise: NoiseSpec, repeats: int) -> float:
    """1 sigma of the mean of repeats, in either coordinate: they share their speckle."""
    return float(np.hypot(noise.spot_sd_px / np.sqrt(repeats), noise.speckle_sd_px))


def best_standoffs(rig: Rig, count: int, repeats: int) -> tuple[float, ...]:
    """Standoffs within the rig's reach that make the worst relative range sd from 0.1 to 5 m small.

    Raises:
        BadInputError: there are no so many with a spot in the picture.
    """
    sensors = drawn_sensors(rig, SEARCH_DRAWS)
    return propose(Choice.of(sensors, candidates(rig), repeats, Aim.of(sensors, RANGES_MM, rig.noise)), count)


def drawn_sensors(rig: Rig, draws: int = DRAWS) -> Expectation:
    """Sensors of the rig's tolerances, in pairs that lie opposite each other about the expected one."""
    table = ParameterTable(sensor_parameters(rig))
    half = np.random.default_rng(SEED).standard_normal((draws // 2, len(table.prior_mean)))
    return Expectation(rig, table.prior_mean + table.prior_sd * np.concatenate([half, -half]))


def candidates(rig: Rig) -> FloatArray:
    """(C,) standoffs within reach, of two significant digits but for the ends."""
    nearest, farthest = rig.bench.reach_mm
    grid = np.geomspace(nearest, farthest, CANDIDATES)
    digits = 10.0 ** (np.floor(np.log10(grid)) - 1)
    return np.unique(np.clip(np.round(grid / digits) * digits, nearest, farthest))


def propose(choice: Choice, count: int) -> tuple[float, ...]:
    """Standoffs that make the criterion small: one after the other, then each exchanged while that helps.

    Far away the noise of the spot that is ranged is most of the worst range, and many designs are as good as
    the best. So standoffs are exchanged once more: of designs within `SPARED` of it the one whose ranges are
    good everywhere.

    V. V. Fedorov, "Theory of Optimal Experiments" (1972), with another criterion. The optimum is a local one.

    Raises:
        BadInputError: there are fewer standoffs to choose from than that.
    """
    if count < 1:
        raise BadInputError(f"--count: expected at least 1, got {count}")
    seen = (choice.rows != 0).any(axis=(2, 3)).mean(axis=0) > 0.5
    if seen.sum() < count:
        raise BadInputError(
            f"--count: expected at most {int(seen.sum())}, got {count}: so many of the {len(seen)} standoffs"
            " to choose from within bench.reach_mm have a spot in the picture"
        )
    chosen: list[int] = []
    for _ in range(count):
        chosen.append(_best(choice, chosen, seen, worst_of)[0])
    chosen = _exchanged(choice, chosen, seen, worst_of)
    limit = choice.worst(chosen) * (1 + SPARED)

    def typical(variance: FloatArray) -> FloatArray:
        return np.where(worst_of(variance) <= limit, typical_of(variance, choice.aim.spot_sd > 0), np.inf)

    return tuple(sorted(choice.standoff_mm[_exchanged(choice, chosen, seen, typical)].tolist()))


def _exchanged(choice: Choice, chosen: list[int], allowed: BoolArray, cost: Cost) -> list[int]:
    """The chosen candidates, each exchanged for another while that lowers the cost."""
    reached = np.inf
    for _ in range(ROUNDS):
        before = reached
        for place in range(len(chosen)):
            rest = [*chosen[:place], *chosen[place + 1 :]]
            best, cheapest = _best(choice, rest, allowed, cost)
            if cheapest < reached * (1 - WORTH):
                chosen, reached = [*rest[:place], best, *rest[place:]], cheapest
        if reached == before:
            break
    return chosen


def _best(choice: Choice, chosen: Sequence[int], allowed: BoolArray, cost: Cost) -> tuple[int, float]:
    """The candidate beside the chosen ones with the least cost, and that cost."""
    costs = np.where(allowed, cost(choice.with_one_more(choice.covariance(chosen))), np.inf)
    costs[list(chosen)] = np.inf
    best = int(costs.argmin())
    return best, float(costs[best])
