"""Design of standoffs: against fits of simulated data, differences of the simulator, and other designs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.proofs import simulate, study
from tests.support.rigs import STANDOFFS_MM
from workbench.calibration.design.expectation import Expectation
from workbench.calibration.design.forecast import RANGES_MM, forecast
from workbench.calibration.design.standoffs import (
    SEARCH_DRAWS,
    SPARED,
    Candidates,
    RangeGoals,
    best_standoffs,
    candidate_standoffs,
    drawn_sensors,
    typical_of,
    worst_of,
)
from workbench.calibration.estimation.batch import fit_batch
from workbench.model.errors import BadInputError
from workbench.model.rig import BenchSpec, load_rig

ROOT = Path(__file__).parents[4]
RIG = load_rig(ROOT / "rigs/thesis-emulated.yaml")
SHIPPED = STANDOFFS_MM


@pytest.fixture(scope="module")
def proposed() -> tuple[float, ...]:
    return best_standoffs(RIG, len(SHIPPED), 10)


class TestProposal:
    """The proposal and what it has to beat, by the criterion and by fits of simulated data."""

    @staticmethod
    def worst(standoffs: tuple[float, ...]) -> float:
        """By other sensors than those the proposal was made for."""
        rng = np.random.default_rng(99)
        table = drawn_sensors(RIG).table
        drawn = rng.standard_normal((64, len(table.parameters)))
        sensors = Expectation(RIG, table.prior_mean + table.prior_sd * drawn)
        goals = RangeGoals.of(sensors, np.geomspace(100.0, 5000.0, 25), RIG.noise)
        candidates = Candidates.of(sensors, np.array(standoffs), 10, goals)
        return candidates.worst(range(len(standoffs)))

    def test_the_criterion_is_the_worst_range_that_the_forecast_tells(self) -> None:
        """Calibration and the noise of the spot that is ranged together."""
        sensors = drawn_sensors(RIG)
        goals = RangeGoals.of(sensors, np.array(RANGES_MM), RIG.noise)
        candidates = Candidates.of(sensors, np.array(SHIPPED), 10, goals)
        predicted = forecast(RIG, SHIPPED, 10).worst_relative_sd
        assert candidates.worst(range(len(SHIPPED))) == pytest.approx(predicted, rel=1e-12)

    def test_noise_that_another_laser_has_changes_the_choice(self) -> None:
        """Two ranges: one hurt by the calibration, the other by its spot, which is the worst in all."""
        by_parameter = np.eye(2)[None]
        goals = RangeGoals(by_parameter, np.array([[0.0, 10.0]]))
        candidates = Candidates(np.array([1.0, 2.0]), 3.0 * np.eye(2)[None, :, None], goals)
        assert candidates.worst([0]) == pytest.approx(np.sqrt(1.0 + 100.0))
        assert candidates.worst([1]) == pytest.approx(np.sqrt(0.1 + 100.0))
        assert candidates.worst_with_one_more(np.eye(2)[None]).argmin() == 1

    def test_it_beats_the_shipped_procedure(self, proposed: tuple[float, ...]) -> None:
        assert self.worst(proposed) < 0.99 * self.worst(SHIPPED)

    def test_near_ranges_are_not_given_away_for_the_worst(self, proposed: tuple[float, ...]) -> None:
        """By the worst range alone it would be 1 % better, and ranges at 150 mm a quarter worse."""
        near = [r for r in forecast(RIG, proposed, 10).ranges if r.range_mm <= 200]
        shipped = [r for r in forecast(RIG, SHIPPED, 10).ranges if r.range_mm <= 200]
        for ours, theirs in zip(near, shipped, strict=True):
            if ours.relative_sd is not None and theirs.relative_sd is not None:
                assert ours.relative_sd < 1.1 * theirs.relative_sd

    def test_no_random_design_of_its_size_beats_it(self, proposed: tuple[float, ...]) -> None:
        rng = np.random.default_rng(3)
        reached = self.worst(proposed)
        for _ in range(20):
            random = rng.choice(candidate_standoffs(RIG), len(proposed), replace=False)
            assert reached < self.worst(tuple(random.tolist()))

    def test_no_exchange_of_one_betters_it(self, proposed: tuple[float, ...]) -> None:
        """Neither the worst range by more than was spared, nor, within that, all ranges."""
        sensors = drawn_sensors(RIG, SEARCH_DRAWS)
        goals = RangeGoals.of(sensors, np.geomspace(100.0, 5000.0, 18), RIG.noise)
        grid = candidate_standoffs(RIG)
        candidates = Candidates.of(sensors, grid, 10, goals)
        chosen = [grid.tolist().index(s) for s in proposed]
        reached = candidates.worst(chosen)
        seen = goals.spot_sd > 0
        typical = typical_of(goals.total(goals.variance(candidates.covariance(chosen)))[:, None], seen)[0]
        for place in range(len(chosen)):
            rest = chosen[:place] + chosen[place + 1 :]
            one_more = candidates.with_one_more(candidates.covariance(rest))[
                :, [i for i in range(len(grid)) if i not in rest]
            ]
            assert worst_of(one_more).min() >= reached / (1 + SPARED)
            as_good = worst_of(one_more) <= reached
            assert (typical_of(one_more, seen)[as_good] >= typical * (1 - 1e-3)).all()

    def test_fits_of_simulated_data_agree(self, proposed: tuple[float, ...]) -> None:
        """The sd at 5 m that fits state: better by the proposal than by the shipped standoffs."""

        def stated(standoffs: tuple[float, ...]) -> float:
            at = np.array(standoffs)
            data = simulate.calibrations(RIG, at, 10, 32, np.random.default_rng(11))
            fitted = fit_batch(RIG, study.placements(RIG, at), data.position_px, data.sd_px)
            sensors = Expectation(RIG, fitted.sensor)
            free, sd = sensors.table.free, sensors.table.prior_sd[sensors.table.free]
            covariance = fitted.sensor_covariance[:, free[:, None], free] / np.outer(sd, sd)
            variance = RangeGoals.of(sensors, np.array([5000.0]), RIG.noise).variance(covariance)
            return float(np.median(np.sqrt(variance.max(axis=-1))))

        assert stated(proposed) < 0.9 * stated(SHIPPED)

    def test_it_stays_within_reach(self) -> None:
        bench = RIG.bench.model_copy(update={"reach_mm": (300.0, 1500.0)})
        found = best_standoffs(RIG.model_copy(update={"bench": bench}), 5, 10)
        assert 300 <= min(found) < max(found) <= 1500
        assert len(set(found)) == 5


def test_one_more_placement_is_a_rank_update() -> None:
    sensors = drawn_sensors(RIG, 4)
    goals = RangeGoals.of(sensors, np.geomspace(100.0, 5000.0, 6), RIG.noise)
    candidates = Candidates.of(sensors, np.array([150.0, 300.0, 900.0, 4000.0]), 5, goals)
    updated = candidates.worst_with_one_more(candidates.covariance([0, 3]))
    afresh = [candidates.worst([0, 3, more]) for more in range(4)]
    np.testing.assert_allclose(updated, afresh, rtol=1e-8)


def test_the_reach_is_a_span() -> None:
    with pytest.raises(ValueError, match=r"expected \[nearest, farthest\] in mm"):
        BenchSpec(reach_mm=(500.0, 500.0))


def test_no_more_standoffs_are_proposed_than_show_a_spot() -> None:
    """A picture of 120 px: u = 59.5 +- 533.3 x 30 / z is in it beyond 270 mm or so."""
    camera = RIG.camera.model_copy(
        update={"width_px": 120, "cx_px": RIG.camera.cx_px.model_copy(update={"value": 59.5})}
    )
    rig = RIG.model_copy(update={"camera": camera})
    sensors = drawn_sensors(rig, SEARCH_DRAWS)
    seen = int((sensors.in_frame(candidate_standoffs(rig)).any(axis=2).mean(axis=0) > 0.5).sum())
    assert 5 < seen < 40
    with pytest.raises(BadInputError, match=f"at most {seen}, got {seen + 1}"):
        best_standoffs(rig, seen + 1, 10)
    with pytest.raises(BadInputError):
        best_standoffs(rig, 0, 10)
