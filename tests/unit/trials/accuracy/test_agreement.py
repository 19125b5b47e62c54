"""Agreement of mean errors with their uncertainty, on sensors drawn from a calibration's covariance."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tests.support.accuracy_runs import STANDOFFS_MM, accuracy_run
from tests.support.rangers import IDS, thesis_ranger
from tests.support.rigs import thesis_rig
from tests.support.simulated_trials import SimulatedBench
from tests.support.statistics import spread
from workbench.trials.accuracy.agreement import Agreement, budget_of
from workbench.trials.accuracy.ranges import CLOSEST, MEAN
from workbench.trials.accuracy.verdict import BIAS_ALARM, bias_probability

RUNS = 40


def bench(seed: int, **change: float) -> SimulatedBench:
    return SimulatedBench.draw(thesis_ranger(), thesis_rig(), seed, change)


@cache
def runs() -> list[dict[str, Agreement]]:
    return [{one.name: one for one in accuracy_run(bench(seed))} for seed in range(RUNS)]


def test_the_ranges_are_closest_mean_and_each_laser() -> None:
    assert list(runs()[0]) == [CLOSEST, MEAN, *IDS]


@pytest.mark.parametrize("name", [MEAN, "L1", "L4"])
def test_mean_errors_are_even_and_as_large_as_stated(name: str) -> None:
    """Errors of one run are correlated: the mean square over standoffs has the runs' own scatter."""
    z = np.array([run[name].bias.z for run in runs() if len(run[name].bias.z) == len(STANDOFFS_MM)])
    own = z.mean(axis=1)
    assert own.mean() == pytest.approx(0.0, abs=4 * own.std(ddof=1) / np.sqrt(len(own)))
    square = (z**2).mean(axis=1)
    assert square.mean() == pytest.approx(1.0, abs=4 * square.std(ddof=1) / np.sqrt(len(square)))


def test_few_true_sensors_are_called_biased() -> None:
    false = np.mean([bias_probability(list(run.values())) < BIAS_ALARM for run in runs()])
    assert false <= BIAS_ALARM + spread(BIAS_ALARM, RUNS)


def test_a_bias_of_three_expanded_uncertainties_is_found() -> None:
    """Errors of each standoff are raised by 3 U."""
    for run in runs()[:20]:
        one = run[MEAN]
        raised = tuple(
            placed.__class__(
                placed.reference, placed.errors_mm + 3 * known.expanded, 0.0, placed.sensitivities
            )
            for placed, known in zip(one.placements, one.uncertainty, strict=True)
        )
        assert Agreement(MEAN, one.bench, raised).bias.probability < 1e-6


def test_coverage_counts_fewer_trials_than_placements() -> None:
    one = runs()[0][MEAN]
    assert 1.0 <= one.coverage.degrees_of_freedom < len(STANDOFFS_MM)
    assert one.coverage.low < one.coverage.value <= one.coverage.high


def test_sources_of_the_budget_add_to_the_variance_of_the_error() -> None:
    one = runs()[0]["L2"]
    for n in range(len(STANDOFFS_MM)):
        repeats = max(1.0, one.repeats.ratio) if one.repeats is not None else 1.0
        budget = budget_of(one, n)
        enlarged = (repeats - 1.0) * budget.sources_mm["noise_mm"] ** 2
        assert budget.explained_mm2 + enlarged == pytest.approx(one.covariance[n, n])


def test_noise_that_is_not_stated_raises_the_alarm_of_the_repeats() -> None:
    noise = thesis_ranger().calibration.laser_ranger.noise.spot_sd_px
    found = [
        {one.name: one for one in accuracy_run(bench(seed).with_unknown(noise_px=2 * noise))}[MEAN].repeats
        for seed in range(5)
    ]
    assert all(one is not None and one.probability < 0.01 for one in found)


def test_observed_scatter_above_the_stated_noise_widens_the_uncertainty() -> None:
    noise = thesis_ranger().calibration.laser_ranger.noise.spot_sd_px
    one, noisy = (
        {each.name: each for each in accuracy_run(bench(1).with_unknown(noise_px=px))}[MEAN]
        for px in (0.0, 5 * noise)
    )
    assert (noisy.u_mm > one.u_mm).all()
    assert noisy.uncertainty[-1].k > 1.96
    assert np.isfinite(noisy.uncertainty[-1].degrees_of_freedom)


def test_linearity_needs_three_true_ranges() -> None:
    two = {one.name: one for one in accuracy_run(bench(1), (300.0, 900.0))}[MEAN]
    assert two.linearity is None
    assert runs()[0][MEAN].linearity is not None
