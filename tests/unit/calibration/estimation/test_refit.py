"""Refits against fits of fewer data."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.rigs import World, thesis_rig
from workbench.calibration.estimation.fit import fit
from workbench.calibration.estimation.refit import measured, optimum_of, problem_of, refit, rows_of

RIG = thesis_rig()


@pytest.mark.parametrize("standoff_mm", [125.0, 600.0, 4500.0])
def test_a_fold_is_the_fit_without_the_placement(standoff_mm: float) -> None:
    observations = World(RIG, 1).observations()
    whole = fit(RIG, observations)
    without = fit(RIG, [s for s in observations if s.standoff_mm != standoff_mm])
    problem = problem_of(whole)
    cells = np.array([whole.cells.placements[i].standoff_mm == standoff_mm for i in whole.cells.placement])
    left = refit(problem, measured(problem) & ~rows_of(cells, problem), optimum_of(whole))
    sensor = whole.sensor
    values = (whole.table.prior_mean + whole.table.prior_sd * left.y)[sensor]
    free = whole.table.prior_sd[sensor] > 0
    off = (values - without.values[sensor])[free] / without.sd[sensor][free]
    assert np.abs(off).max() < 1e-3
    sd = whole.table.prior_sd[sensor] * np.sqrt(np.diag(left.covariance)[sensor])
    np.testing.assert_allclose(sd, without.sd[sensor], rtol=1e-3)
