"""The problem's derivatives against differences."""

from __future__ import annotations

import numpy as np

from tests.support.rigs import World, thesis_rig
from workbench.calibration.estimation.fit import fit
from workbench.calibration.estimation.problem import LeastSquaresProblem
from workbench.calibration.estimation.refit import optimum_of, problem_of

RIG = thesis_rig()


def test_what_a_standoff_moves_is_its_difference() -> None:
    problem, y = (
        problem_of(fit(RIG, World(RIG, 1).observations())),
        optimum_of(fit(RIG, World(RIG, 1).observations())),
    )
    step_mm = 1e-3
    ahead, behind = (
        LeastSquaresProblem(
            problem.layout,
            problem.data._replace(standoff_mm=np.asarray(problem.data.standoff_mm) + sign * step_mm),
        ).linearise(y, 2.0)[0]
        for sign in (1, -1)
    )
    np.testing.assert_allclose(
        problem.by_standoff(y, 2.0), (ahead - behind) / (2 * step_mm), rtol=1e-6, atol=1e-8
    )
