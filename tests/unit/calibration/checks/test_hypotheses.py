"""Other accounts of the data: what a search finds, and what it saves by first order."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.corrupted_data import told_as
from tests.support.rigs import World, thesis_rig
from workbench.calibration.checks import hypotheses
from workbench.calibration.checks.cross_validation import rows_at
from workbench.calibration.checks.hypotheses import explain_misfit
from workbench.calibration.estimation.refit import measured, optimum_of, problem_of, refit
from workbench.calibration.selection.outliers import fit_without_outliers

RIG = thesis_rig()


def test_what_leaving_a_placement_out_gains_is_known_to_first_order() -> None:
    fit = fit_without_outliers(RIG, World(RIG, 3).observations())
    problem = problem_of(fit)
    state = refit(problem, measured(problem), optimum_of(fit))
    for index in range(len(fit.cells.placements)):
        rows = rows_at(problem, index)
        gain = state.cost - refit(problem, state.used & ~rows, np.zeros(len(state.y))).cost
        assert hypotheses._gain_without(state, rows) == pytest.approx(gain, rel=0.1)


@pytest.mark.parametrize(("standoff_mm", "off_mm"), [(900.0, 4.5), (900.0, 5.0), (1400.0, 12.0)])
def test_nothing_is_missed_where_no_refit_is_made(
    standoff_mm: float, off_mm: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    observations = told_as(World(RIG, 20_001).observations(), standoff_mm, standoff_mm + off_mm)
    fit = fit_without_outliers(RIG, observations)
    quick = explain_misfit(fit)
    monkeypatch.setattr(hypotheses, "CLEARLY_LESS", 0.0)
    assert [(h.kind, h.subject) for h in quick] == [(h.kind, h.subject) for h in explain_misfit(fit)]
