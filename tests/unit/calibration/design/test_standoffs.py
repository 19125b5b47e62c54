"""Design of standoffs: against fits of simulated data, differences of the simulator, and other designs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.proofs import bound, simulate, study
from tests.support.rigs import PROVENANCE, STANDOFFS_MM, World, thesis_rig
from workbench.calibration.design.expectation import Expectation
from workbench.calibration.design.forecast import RANGES_MM, forecast
from workbench.calibration.design.next_standoff import advise
from workbench.calibration.design.standoffs import (
    DRAWS,
    SPARED,
    Aim,
    Choice,
    best_standoffs,
    candidates,
    drawn_sensors,
    posterior,
    typical_of,
    worst_of,
)
from workbench.calibration.estimation.batch import fit_batch
from workbench.calibration.estimation.fit import CalibrationFit, fit
from workbench.calibration.verdict.export import calibrate
from workbench.model.acceptance import Acceptance
from workbench.model.errors import BadInputError
from workbench.model.nested import fix_parameters
from workbench.model.rig import BenchSpec, Rig, load_rig
from workbench.procedure.engine.procedure_file import load_procedure
from workbench.sensor.calibrated import CalibratedSensor
from workbench.steps.capture_grid import CaptureGridStep

ROOT = Path(__file__).parents[4]
RIG = load_rig(ROOT / "rigs/thesis-emulated.yaml")
SHIPPED = STANDOFFS_MM
FITS = 256


def shifted(rig: Rig) -> Expectation:
    """One sensor that is not the expected one, all of whose spots are in frame."""
    base = drawn_sensors(rig)
    rng = np.random.default_rng(5)
    sd = base.table.prior_sd.copy()
    sd[1:3] = 5.0
    return Expectation(rig, (base.table.prior_mean + sd * rng.uniform(-1, 1, len(sd)))[None])


def test_spots_tell_what_differences_of_the_simulator_say() -> None:
    """The bound of the proofs: OpenCV's lens and linear algebra, differences, the same noise."""
    sensors = shifted(RIG)
    standoffs = np.array([160.0, 300.0, 1000.0, 4000.0])
    sd_px = float(np.hypot(0.05 / np.sqrt(10), 0.04))
    shape = (1, len(standoffs), 4, 2)
    data = simulate.Calibrations(sensors.sensors, np.zeros((1, 4, 3)), np.zeros(shape), np.full(shape, sd_px))
    theirs = bound.parameter_covariance(RIG, standoffs, data)[0]
    free = sensors.table.free
    ours = posterior(sensors.spot_rows(standoffs, sd_px)[..., free])[0]
    sd = sensors.table.prior_sd[free]
    # Differences and derivatives part by some 1e-5 of the largest.
    np.testing.assert_allclose(np.sqrt(np.diag(ours)) * sd, np.sqrt(np.diag(theirs))[free], rtol=1e-4)


def test_ranges_depend_on_parameters_as_the_sensor_says() -> None:
    world = World(thesis_rig(), 2)
    calibration = calibrate(fit(world.rig, world.observations()), Acceptance(), PROVENANCE)[0]
    sensor = CalibratedSensor(calibration)
    parameters = calibration.laser_ranger.parameters
    expectation = Expectation(world.rig, np.array([parameters.values]))
    at = np.array([200.0, 900.0, 4000.0])
    noise = calibration.laser_ranger.noise
    rows, own = expectation.range_rows(at, float(np.hypot(noise.spot_sd_px, noise.speckle_sd_px)))
    prior_sd = np.array(parameters.prior_sd)
    for laser, laser_id in enumerate(sensor.ids):
        found = sensor.typical_ranges(laser_id, at)
        np.testing.assert_allclose(
            rows[0, :, laser], found.by_parameter * prior_sd / at[:, None], rtol=1e-6, atol=1e-12
        )
        np.testing.assert_allclose(own[0, :, laser], found.spot_sd_mm / at, rtol=1e-6)


def test_a_range_out_of_frame_is_not_a_number() -> None:
    rows, own = shifted(RIG).range_rows(np.array([40.0, 300.0]), 0.05)
    assert np.isnan(own[0, 0, [0, 3]]).all()
    assert np.isnan(rows[0, 0, [0, 3]]).all()
    assert np.isfinite(own[0, 1]).all()


@pytest.fixture(scope="module")
def fits() -> tuple[list[str], np.ndarray, np.ndarray]:
    """Names, and stated sd of parameters (N, F) and relative sd of ranges (N, K, L), of simulated fits."""
    standoffs = np.array(SHIPPED)
    data = simulate.calibrations(RIG, standoffs, 10, FITS, np.random.default_rng(7))
    fitted = fit_batch(RIG, study.placements(RIG, standoffs), data.position_px, data.sd_px)
    fair = fitted.noise_scale == 1.0
    sensors = Expectation(RIG, fitted.sensor[fair])
    free = sensors.table.free
    sd = sensors.table.prior_sd[free]
    covariance = fitted.sensor_covariance[fair][:, free[:, None], free] / np.outer(sd, sd)
    aim = Aim.of(sensors, np.array(RANGES_MM), RIG.noise)
    relative = np.where(aim.spot_sd > 0, np.sqrt(aim.variance(covariance) + aim.spot_sd**2), np.nan)
    names = [sensors.table.parameters[i].name for i in free]
    return names, fitted.sd[fair][:, free], relative.reshape(len(relative), len(RANGES_MM), -1)


def test_predicted_deviations_are_those_of_fits(fits: tuple[list[str], np.ndarray, np.ndarray]) -> None:
    names, sd, relative = fits
    predicted = forecast(RIG, SHIPPED, 10)
    assert [p.name for p in predicted.parameters] == names
    typical = np.median(sd, axis=0)
    # Two medians of deviations that scatter from sensor to sensor, 4 sigma; 1 % for the estimate's own place.
    chance = 4 * 1.25 * sd.std(axis=0) / typical * np.sqrt(1 / FITS + 1 / DRAWS)
    ratio = np.array([p.sd for p in predicted.parameters]) / typical
    assert (np.abs(ratio - 1.0) < chance + 0.01).all()
    assert np.median(chance) < 0.08
    assert abs(np.median(ratio) - 1.0) < 0.02
    lasers = len(RIG.lasers)
    far = [r.relative_sd for r in predicted.ranges][2 * lasers :]
    np.testing.assert_allclose(
        np.array(far, float), np.nanmedian(relative, axis=0).ravel()[2 * lasers :], rtol=0.03
    )


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
        sensors = Expectation(RIG, table.prior_mean + table.prior_sd * rng.standard_normal((64, 26)))
        aim = Aim.of(sensors, np.geomspace(100.0, 5000.0, 25), RIG.noise)
        choice = Choice.of(sensors, np.array(standoffs), 10, aim)
        return choice.worst(range(len(standoffs)))

    def test_the_criterion_is_the_worst_range_that_the_forecast_tells(self) -> None:
        """Calibration and the noise of the spot that is ranged together."""
        sensors = drawn_sensors(RIG)
        aim = Aim.of(sensors, np.array(RANGES_MM), RIG.noise)
        choice = Choice.of(sensors, np.array(SHIPPED), 10, aim)
        told = forecast(RIG, SHIPPED, 10).worst_relative_sd
        assert choice.worst(range(len(SHIPPED))) == pytest.approx(told, rel=1e-12)

    def test_noise_that_another_laser_has_changes_the_choice(self) -> None:
        """Two ranges: one hurt by the calibration, the other by its spot, which is the worst in all."""
        by_parameter = np.eye(2)[None]
        aim = Aim(by_parameter, np.array([[0.0, 10.0]]))
        choice = Choice(np.array([1.0, 2.0]), 3.0 * np.eye(2)[None, :, None], aim)
        assert choice.worst([0]) == pytest.approx(np.sqrt(1.0 + 100.0))
        assert choice.worst([1]) == pytest.approx(np.sqrt(0.1 + 100.0))
        assert choice.worst_with_one_more(np.eye(2)[None]).argmin() == 1

    def test_it_beats_the_shipped_procedure(self, proposed: tuple[float, ...]) -> None:
        assert self.worst(proposed) < 0.99 * self.worst(SHIPPED)

    def test_near_ranges_are_not_given_away_for_the_worst(self, proposed: tuple[float, ...]) -> None:
        """All far, the worst range would be 1 % better and those below 200 mm two or three times worse."""
        near = [r for r in forecast(RIG, proposed, 10).ranges if r.range_mm <= 200]
        shipped = [r for r in forecast(RIG, SHIPPED, 10).ranges if r.range_mm <= 200]
        for ours, theirs in zip(near, shipped, strict=True):
            if ours.relative_sd is not None and theirs.relative_sd is not None:
                assert ours.relative_sd < 1.1 * theirs.relative_sd

    def test_no_random_design_of_its_size_beats_it(self, proposed: tuple[float, ...]) -> None:
        rng = np.random.default_rng(3)
        reached = self.worst(proposed)
        for _ in range(20):
            random = rng.choice(candidates(RIG), len(proposed), replace=False)
            assert reached < self.worst(tuple(random.tolist()))

    def test_no_exchange_of_one_betters_it(self, proposed: tuple[float, ...]) -> None:
        """Neither the worst range by more than was spared, nor, within that, all ranges."""
        sensors = drawn_sensors(RIG, 32)
        aim = Aim.of(sensors, np.geomspace(100.0, 5000.0, 18), RIG.noise)
        grid = candidates(RIG)
        choice = Choice.of(sensors, grid, 10, aim)
        chosen = [grid.tolist().index(s) for s in proposed]
        reached = choice.worst(chosen)
        seen = aim.spot_sd > 0
        typical = typical_of(aim.total(aim.variance(choice.covariance(chosen)))[:, None], seen)[0]
        for place in range(len(chosen)):
            rest = chosen[:place] + chosen[place + 1 :]
            one_more = choice.with_one_more(choice.covariance(rest))[
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
            variance = Aim.of(sensors, np.array([5000.0]), RIG.noise).variance(covariance)
            return float(np.median(np.sqrt(variance.max(axis=-1))))

        assert stated(proposed) < 0.9 * stated(SHIPPED)

    def test_it_stays_within_reach(self) -> None:
        bench = RIG.bench.model_copy(update={"reach_mm": (300.0, 1500.0)})
        found = best_standoffs(RIG.model_copy(update={"bench": bench}), 5, 10)
        assert 300 <= min(found) < max(found) <= 1500
        assert len(set(found)) == 5


def test_one_more_placement_is_a_rank_update() -> None:
    sensors = drawn_sensors(RIG, 4)
    aim = Aim.of(sensors, np.geomspace(100.0, 5000.0, 6), RIG.noise)
    choice = Choice.of(sensors, np.array([150.0, 300.0, 900.0, 4000.0]), 5, aim)
    updated = choice.worst_with_one_more(choice.covariance([0, 3]))
    afresh = [choice.worst([0, 3, more]) for more in range(4)]
    np.testing.assert_allclose(updated, afresh, rtol=1e-8)


def test_repeats_share_their_speckle() -> None:
    """Ten thousand readings of each laser cannot do what a second placement does."""
    many = forecast(RIG, (200.0, 1000.0), 10_000).worst_relative_sd_of_calibration
    few = forecast(RIG, (200.0, 1000.0), 10).worst_relative_sd_of_calibration
    more = forecast(RIG, (200.0, 210.0, 1000.0, 1100.0), 10).worst_relative_sd_of_calibration
    assert more < many < few


def test_a_spot_that_may_be_out_of_the_picture_is_noted() -> None:
    found = forecast(RIG, (105.0, 300.0, 1000.0), 10)
    assert [note.split(" the spot")[0] for note in found.notes] == ["at 105 mm"]
    with pytest.raises(BadInputError, match=r"standoff 10 mm: expected a laser's spot in the picture"):
        forecast(RIG, (10.0, 300.0), 10)


def test_a_range_that_no_spot_shows_has_no_forecast() -> None:
    camera = RIG.camera.model_copy(update={"width_px": 320})
    found = forecast(RIG.model_copy(update={"camera": camera}), (300.0, 600.0, 1000.0), 10)
    nearest = {r.laser_id: r.relative_sd for r in found.ranges if r.range_mm == 100.0}
    assert nearest["L4"] is None


def test_a_rig_of_constants_has_nothing_to_determine() -> None:
    rig = thesis_rig()
    names = [p.name for p in Expectation(rig, np.empty((0, 0))).table.parameters]
    fixed = fix_parameters(rig, names)
    found = forecast(fixed, (200.0, 1000.0), 10)
    assert found.parameters == ()
    assert found.directions == ()
    assert found.worst_relative_sd_of_calibration == 0.0


def test_the_reach_is_a_span() -> None:
    with pytest.raises(ValueError, match=r"expected \[nearest, farthest\] in mm"):
        BenchSpec(reach_mm=(500.0, 500.0))


class TestAdvice:
    """During a procedure."""

    def test_it_ends_at_what_the_fit_states(self) -> None:
        world = World(RIG, 3)
        observations = world.observations(SHIPPED, 10)
        advice = advise(RIG, observations, SHIPPED)
        assert advice is not None
        calibration, _ = calibrate(fit(RIG, observations), Acceptance(), PROVENANCE)
        stated = calibration.laser_ranger.validity.max_relative_range_sd
        assert advice.relative_range_sd == pytest.approx(stated, rel=0.01)
        assert advice.placements == len(SHIPPED)

    def test_a_placement_where_it_says_gains_what_it_says(self) -> None:
        world = World(RIG, 3)
        before = advise(RIG, world.observations(SHIPPED[:3], 10), SHIPPED)
        assert before is not None
        assert before.then_relative_range_sd < 0.3 * before.relative_range_sd
        further = (*SHIPPED[:3], before.next_standoff_mm)
        after = advise(RIG, world.observations(further, 10), SHIPPED)
        assert after is not None
        assert after.relative_range_sd == pytest.approx(before.then_relative_range_sd, rel=0.15)

    @pytest.mark.parametrize(("seed", "noise"), [(1, 1.0), (2, 1.0), (4, 3.0)])
    def test_it_fits_as_the_fit_does(self, seed: int, noise: float) -> None:
        """With noise three times what is stated the deviations grow as much."""
        stated = RIG.noise
        louder = stated.model_copy(
            update={name: noise * getattr(stated, name) for name in ("spot_sd_px", "speckle_sd_px")}
        )
        observations = World(RIG.model_copy(update={"noise": louder}), seed).observations(SHIPPED[::2], 10)
        advice = advise(RIG, observations, SHIPPED)
        assert advice is not None
        fitted = fit(RIG, observations)
        assert (fitted.noise_scale > 2) == (noise == 3.0)
        assert advice.relative_range_sd == pytest.approx(self.worst_of_fit(fitted), rel=1e-3)

    @pytest.mark.parametrize("told", [{"standoff_sd_mm": 5.0}, {"yaw_deg": 20.0}])
    def test_what_captures_tell_of_their_placement_counts(self, told: dict[str, Any]) -> None:
        plain = World(RIG, 3).observations(SHIPPED[::2], 10)
        observations = [replace(s, **told) for s in plain]
        advice, without = advise(RIG, observations, SHIPPED), advise(RIG, plain, SHIPPED)
        assert advice is not None
        assert without is not None
        assert advice.relative_range_sd == pytest.approx(self.worst_of_fit(fit(RIG, observations)), rel=1e-3)
        assert advice.relative_range_sd != pytest.approx(without.relative_range_sd, rel=0.01)

    @staticmethod
    def worst_of_fit(fitted: CalibrationFit) -> float:
        """The worst range over the shipped procedure's span, the noise of its spot included."""
        sensors = Expectation(RIG, fitted.values[None, fitted.sensor])
        free = sensors.table.free
        prior_sd = sensors.table.prior_sd[free]
        covariance = fitted.covariance[np.ix_(free, free)] / np.outer(prior_sd, prior_sd)
        spot = RIG.noise.model_copy(
            update={
                "spot_sd_px": RIG.noise.spot_sd_px * fitted.noise_scale * fitted.cells.repeat_scale,
                "speckle_sd_px": RIG.noise.speckle_sd_px * fitted.noise_scale,
            }
        )
        aim = Aim.of(sensors, np.geomspace(125.0, 4500.0, 18), spot)
        return float(np.sqrt((aim.variance(covariance[None]) + aim.spot_sd**2).max()))

    @pytest.mark.parametrize("seed", [1, 2])
    def test_the_worst_residual_is_named(self, seed: int) -> None:
        """A spot that lies 3 px off is seen while the target still stands, by the final fit's residuals."""
        plain = World(RIG, seed).observations(SHIPPED[:6], 10)
        bad = ("L3", SHIPPED[4])
        observations = [
            replace(s, u_px=s.u_px + 3.0) if (s.laser_id, s.standoff_mm) == bad else s for s in plain
        ]
        advice, without = advise(RIG, observations, SHIPPED), advise(RIG, plain, SHIPPED)
        assert advice is not None
        assert without is not None
        assert (advice.worst_laser_id, advice.worst_standoff_mm) == bad
        assert 1.0 < advice.worst_residual_px < 3.1, "the fit takes some of it up"
        assert without.worst_residual_px < 0.3
        fitted = fit(RIG, plain)
        in_sd = np.nan_to_num(np.abs(fitted.residual_px) / (fitted.cells.sd_px * fitted.noise_scale))
        assert without.worst_residual_sd == pytest.approx(in_sd.max(), rel=0.01)
        assert without.worst_residual_px == pytest.approx(
            np.abs(fitted.residual_px).flat[int(in_sd.argmax())], rel=0.01
        )

    def test_too_little_is_no_advice(self) -> None:
        world = World(RIG, 3)
        assert advise(RIG, [], SHIPPED) is None
        assert advise(RIG, world.observations(SHIPPED[:1], 10), SHIPPED) is None

    def test_the_shipped_procedure_is_the_one_meant_here(self) -> None:
        steps = load_procedure(ROOT / "procedures/calibrate-flat.yaml").steps
        assert [s.standoffs_mm for s in steps if isinstance(s, CaptureGridStep)] == [SHIPPED]
