"""Standoff of the latest placement by its spots, predicted from the earlier placements.

The test is that of cross-validation: the fit without the placement predicts its spots, with the covariance of
its parameters and the placement's own error and tilts at their priors. A misread ruler is found while the
target still stands there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.calibration.checks.cross_validation import by_standoff, iterated_error, range_error, rows_at
from workbench.calibration.data.observations import Observation, group
from workbench.calibration.design.next_standoff import padded
from workbench.calibration.estimation.fit import table_of
from workbench.calibration.estimation.problem import LeastSquaresProblem
from workbench.calibration.estimation.refit import measured, refit_with_scale, rows_of
from workbench.model.rig import Rig
from workbench.model.stats import norm_cdf, t_cdf

FEWEST_EARLIER = 3
"""Least number of earlier placements for a prediction."""
IMPROBABLE = 2 * float(norm_cdf(-5.0))
"""Two-sided p value below which the standoff contradicts the prediction: 5 standard deviations."""


@dataclass(frozen=True)
class LatestStandoff:
    """Comparison of a placement's standoff by the ruler with that by its spots."""

    error_mm: float
    """By the spots - by the ruler; infinite where the spots fit no standoff."""
    sd_mm: float
    """Standard deviation of `error_mm` where the ruler is right."""
    p: float
    """Two-sided p value; Student's t where the noise is estimated."""
    earlier: int
    """Number of earlier placements."""

    @property
    def contradicts(self) -> bool:
        """Whether the ruler was misread, the target has slipped, or an earlier placement is wrong."""
        return self.p < IMPROBABLE


def latest_standoff(
    rig: Rig, observations: Sequence[Observation], key: str, planned: int
) -> LatestStandoff | None:
    """Compare the standoff of a placement with the prediction from all others.

    Args:
        rig: priors and noise.
        observations: of flat targets, those of the placement among them.
        key: key of the placement.
        planned: number of placements of the whole procedure, for which the program is compiled.

    Returns:
        None with fewer than FEWEST_EARLIER other placements, or where its spots do not depend on the range.
    """
    cells, _ = group(observations, rig.laser_ids, rig.noise)
    keys = [placement.key for placement in cells.placements]
    if key not in keys or len(keys) <= FEWEST_EARLIER:
        return None
    index = keys.index(key)
    whole = padded(cells, len(rig.lasers), planned)
    table = table_of(rig, whole.placements)
    problem = LeastSquaresProblem.of(rig, table, whole, ())
    others = measured(problem) & ~rows_at(problem, index)
    spots = rows_of(whole.placement == index, problem) & measured(problem)
    with np.errstate(over="ignore", invalid="ignore"):
        reduced = refit_with_scale(problem, others, np.zeros(len(table.prior_mean)))
        w = by_standoff(reduced)
        if not (w[spots] ** 2).sum() > 0:
            return None
        first_order_mm, sd_mm = range_error(reduced, spots, w)
        standoff_mm, offset_mm = cells.placements[index].standoff_mm, rig.bench.offset_mm.value
        error_mm = iterated_error(reduced, index, spots, standoff_mm, offset_mm)
    if not np.isfinite([first_order_mm, sd_mm]).all():
        return None
    z = -abs(first_order_mm / sd_mm)
    p = 2 * float(norm_cdf(z) if reduced.scale == 1.0 else t_cdf(z, reduced.freedom))
    return LatestStandoff(np.inf if error_mm is None else error_mm, sd_mm, p, len(keys) - 1)
