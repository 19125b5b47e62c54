"""Whitened errors of all lasers at all placements."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.rangers import thesis_ranger
from tests.support.rigs import thesis_rig
from tests.support.simulated_trials import SimulatedBench
from workbench.procedure.engine.step import flat_placement
from workbench.trials.verify.changes import changes
from workbench.trials.verify.laser_errors import LaserErrors, laser_errors
from workbench.trials.verify.reference import Reference
from workbench.trials.verify.statistics import check_placement

SENSOR = thesis_ranger().sensor
RUNS = 60


def errors(seed: int, same_bench: bool, change: dict[str, float] | None = None) -> LaserErrors:
    one = SimulatedBench.draw(thesis_ranger(), thesis_rig(), seed, change, same_bench)
    checks = [
        check_placement(SENSOR, one.spot_readings("v", flat_placement("v", mm), 5), sd_mm)
        for mm, sd_mm in ((600.0, 600.0), (250.0, 0.3), (700.0, 0.3), (1800.0, 0.3))
    ]
    make = Reference.of_calibration if same_bench else Reference.own
    found = laser_errors(make(SENSOR, one.rig.bench), checks)
    assert found is not None
    return found


@pytest.mark.parametrize("same_bench", [True, False])
def test_scores_of_valid_calibrations_are_standard_normal(same_bench: bool) -> None:
    """60 x 16 scores: sd of their mean square 0.046."""
    scores = np.array([errors(seed, same_bench).scores for seed in range(RUNS)])
    assert scores.shape == (RUNS, 16)
    assert (scores**2).mean() == pytest.approx(1.0, abs=4 * 0.046)
    assert scores.mean() == pytest.approx(0.0, abs=4 / np.sqrt(scores.size))


def test_a_change_moves_the_scores_along_its_derivative() -> None:
    """A change of 2 mrad is a shift of some 40 standard deviations, and noise adds to it."""
    column = SENSOR.calibration.laser_ranger.parameters.names.index("L3.tx")
    for seed in range(3):
        moved = errors(seed, True, {"L3.tx": 0.002})
        along = moved.by_parameter[:, column]
        assert along @ moved.scores / (along @ along) == pytest.approx(
            0.002, abs=4 / float(np.linalg.norm(along))
        )
        assert moved.chi2 > 900


def test_a_standoff_that_is_not_measured_hides_the_pinhole() -> None:
    """A turned laser at one placement is not taken for a displaced pinhole."""
    one = SimulatedBench.draw(thesis_ranger(), thesis_rig(), 1, {"L2.tx": 0.002}, same_bench=True)
    check = check_placement(SENSOR, one.spot_readings("v", flat_placement("v", 600.0), 5), 600.0)
    found = changes(SENSOR, laser_errors(Reference.own(SENSOR, one.rig.bench), [check]))
    gains = {change.parameters: change.gain for change in found}
    assert gains["L2.tx",] > 50
    assert gains["offset_mm",] < 4


def test_without_a_spot_there_are_no_errors() -> None:
    assert laser_errors(Reference.own(SENSOR, thesis_rig().bench), []) is None
