"""The proofs' own parts: few calibrations, in seconds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from tests.proofs import bound, fisheye, joint, report, sessions, shape_scores, shapes, simulate, study
from tests.proofs.ranging import ranges
from tests.proofs.solve import at_once, one_by_one
from tests.support.rigs import PROVENANCE, STANDOFFS_MM, World, fisheye_rig, thesis_rig
from tests.support.surfaces import readings
from workbench.calibration.data.observations import as_grid
from workbench.calibration.estimation.batch import fit_batch
from workbench.calibration.estimation.fit import fit
from workbench.calibration.verdict.export import calibrate
from workbench.model.acceptance import Acceptance
from workbench.model.rig import load_rig
from workbench.sensor.calibrated import CalibratedSensor

ROOT = Path(__file__).parents[2]


def test_many_ranges_are_those_of_the_sensor() -> None:
    world = World(thesis_rig(), 1)
    single = fit(world.rig, world.observations())
    sensor = CalibratedSensor(calibrate(single, Acceptance(), PROVENANCE)[0])
    position, sd = as_grid(single.cells, 4)
    batch = fit_batch(world.rig, single.cells.placements, position[None], sd[None])
    at = np.array([150.0, 700.0, 4000.0])
    spots = np.stack([sensor.spot_px(i, at) for i in sensor.ids], axis=1) + 0.05
    spots[0, 1] = np.nan

    many = ranges(
        world.rig, batch.sensor, batch.sensor_covariance, spots[None], np.array([np.hypot(0.03, 0.04)])
    )
    flat, flat_sd = many.flat(batch.sensor_covariance)
    for k in range(len(at)):
        seen = [n for n in range(4) if np.isfinite(spots[k, n]).all()]
        one = sensor.ranges([sensor.ids[n] for n in seen], spots[k, seen], np.full((len(seen), 2), np.nan))
        np.testing.assert_allclose(many.range_mm[0, k, seen], one.range_mm, rtol=1e-9)
        np.testing.assert_allclose(many.sd_mm[0, k, seen], one.sigma_mm, rtol=1e-6)
        weight = one.spot_sd_mm**-2 / (one.spot_sd_mm**-2).sum()
        np.testing.assert_allclose(flat[0, k], weight @ one.range_mm, rtol=1e-9)
        np.testing.assert_allclose(flat_sd[0, k], np.sqrt(weight @ one.covariance_mm2 @ weight), rtol=1e-6)
    assert np.isnan(many.range_mm[0, 0, 1])


def test_the_simulator_is_the_unit_tests_world() -> None:
    world = World(thesis_rig(), 7)
    sensor = np.array([[world.values[name] for name in simulate.names(world.rig)]])
    yaw, pitch = 0.02, -0.03
    slopes = np.tan([[[yaw, pitch]] * 2]).reshape(1, 2, 2)
    spots = simulate.spots(world.rig, sensor, np.array([[300.0, 2000.0]]), slopes)
    for k, z0 in enumerate((300.0, 2000.0)):
        for n, laser in enumerate(world.rig.laser_ids):
            np.testing.assert_allclose(spots[0, k, n], world.pixel(laser, z0, yaw, pitch), atol=1e-9)


def test_stated_deviations_are_near_the_bound() -> None:
    """The stated covariance is taken at the estimate, the bound at the truth: a few per cent differ."""
    rig = load_rig(ROOT / "rigs/thesis-emulated.yaml")
    standoffs = np.array(STANDOFFS_MM)
    data = simulate.calibrations(rig, standoffs, 10, 6, np.random.default_rng(3))
    covariance = bound.parameter_covariance(rig, standoffs, data)
    fitted = fit_batch(rig, study.placements(rig, standoffs), data.position_px, data.sd_px)
    of_bound = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    stated = fitted.sd[:, : of_bound.shape[1]] / fitted.noise_scale[:, None]
    np.testing.assert_allclose(stated, of_bound, rtol=0.1)


def test_a_small_proof_makes_its_tables() -> None:
    rig = load_rig(ROOT / "rigs/thesis-emulated.yaml")
    outcome = study.run(rig, np.array(STANDOFFS_MM), 10, 40, np.random.default_rng(5))
    lines, misses = report.tables(rig, outcome, "fitted")
    # Few calibrations miss limits by chance; every miss must be told by name.
    assert [line for line in lines if line.startswith("MISSED")] == [f"MISSED  {miss}" for miss in misses]
    assert any(line.startswith("not determined") and "ruler_scale" in line for line in lines)
    assert np.isfinite(outcome.parameter).all()
    assert not outcome.unsolved.any()


def test_joint_distance_of_a_small_error_is_that_in_the_parameters() -> None:
    """A change of coordinates changes a distance only by its curvature."""
    rig = thesis_rig()
    rng = np.random.default_rng(3)
    sensor = simulate.draw_truths(rig, 5, rng)
    free = np.array([prior.sd > 0 for prior in simulate.priors(rig)])
    root = (
        rng.normal(size=(5, free.sum(), free.sum()))
        * np.array([p.sd for p in simulate.priors(rig)])[free, None]
    )
    covariance = np.zeros((5, len(free), len(free)))
    covariance[np.ix_(np.arange(5), free, free)] = 1e-10 * root @ root.transpose(0, 2, 1)
    error = np.zeros_like(sensor)
    error[:, free] = 1e-5 * (root @ rng.normal(size=(5, free.sum(), 1)))[..., 0]
    found = joint.joint_p(rig, sensor, covariance, sensor + error)
    whitened = np.linalg.solve(1e-5 * root, error[:, free, None])[..., 0]
    np.testing.assert_allclose(found, chi2.sf((whitened**2).sum(axis=1), free.sum()), rtol=0.01)


@pytest.mark.thorough
def test_a_small_proof_of_the_fisheye_scores_every_range() -> None:
    scores, unsolved = fisheye.scores(fisheye_rig(), 24, 7)
    assert unsolved == 0
    assert len(scores) == 4 * len(fisheye.RANGES_MM)
    # Errors of one calibration are alike at all ranges: 24 calibrations, four deviations.
    assert np.mean([one.coverage for one in scores]) > 0.95 - 4 * np.sqrt(0.05 * 0.95 / 24)
    rms = np.sqrt(np.mean([one.rms_over_bound**2 for one in scores]))
    assert rms == pytest.approx(1.0, abs=4 * np.sqrt(0.5 / 24))


def test_one_by_one_is_at_once_where_every_term_stays() -> None:
    rig = load_rig(ROOT / "rigs/thesis-emulated.yaml")
    standoffs = np.array(STANDOFFS_MM)
    data = simulate.calibrations(rig, standoffs, 10, 4, np.random.default_rng(5))
    many = at_once(rig, study.placements(rig, standoffs), data)
    single = one_by_one(rig, study.placements(rig, standoffs), data)
    sd = np.sqrt(np.diagonal(many.covariance, axis1=1, axis2=2))
    free = sd > 0
    np.testing.assert_allclose((single.sensor - many.sensor)[free] / sd[free], 0.0, atol=1e-5)
    np.testing.assert_allclose(single.covariance, many.covariance, atol=1e-6 * many.covariance.max())


@pytest.mark.parametrize(
    ("scale", "bias", "missed"), [(1.0, 0.0, set()), (1.5, 0.0, {"rms", "within"}), (1.0, 0.6, {"mean"})]
)
def test_sessions_are_missed_where_their_intervals_are_wrong(
    scale: float, bias: float, missed: set[str]
) -> None:
    rig = load_rig(ROOT / "rigs/thesis-emulated.yaml")
    size, free = len(simulate.names(rig)), sum(prior.sd > 0 for prior in simulate.priors(rig))
    rng = np.random.default_rng(8)
    drawn = []
    for _ in range(100):
        z, ranges = scale * rng.normal(size=size) + bias, scale * rng.normal(size=(10, 4)) + bias
        ranges[0, 0] = np.nan
        drawn.append(sessions.Outcome(z, ranges, 0.01 * ranges, float((z[:free] ** 2).sum()), free))
    lines, misses = sessions.scores(rig, drawn)
    assert len(lines) == 1 + size + 39 + 3
    told = {what for what in ("rms", "within", "mean") if sum(what in miss for miss in misses) > 30}
    assert told >= missed
    assert bool(misses) == bool(missed)
    assert any("all parameters together" in miss for miss in misses) == (scale > 1 or bias > 0)


def test_the_table_of_shapes_in_the_docs_is_what_comes_out() -> None:
    """Two of its columns; another processor's rounding may tip a reading or two of a thousand."""
    documented = _cells((ROOT / "docs/ranging.md").read_text().splitlines())
    computed = _cells(list(shapes.shape_table(shapes.Simulation(readings), (600, 2000))))
    assert computed.keys() == documented.keys() == shapes.ROWS.keys()
    for name, cells in computed.items():
        told = [documented[name][shapes.CLOSEST_MM.index(at)] for at in (600, 2000)]
        np.testing.assert_allclose(told, cells, atol=1.0, err_msg=name)


def test_a_small_proof_of_shapes_and_angles_meets_its_limits() -> None:
    lines, misses = shape_scores.scores(400, 3)
    assert len(lines) == 1 + len(shape_scores.FLATS_MM) + len(shape_scores.INCLINES)
    assert misses == []


def test_a_score_far_from_its_limits_is_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shape_scores, "COVERAGE", (0.2, 0.3))
    lines, misses = shape_scores.scores(50, 3)
    assert len(misses) == 1
    assert lines[-1] == f"MISSED  {misses[0]}"


def _cells(lines: list[str]) -> dict[str, list[tuple[float, ...]]]:
    """The first table's rows by name, each cell as its two numbers."""
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]
    return {
        row[0]: [tuple(float(part) for part in cell.split("/")) for cell in row[1:]]
        for row in reversed(rows)
        if row[0] in shapes.ROWS and "/" in row[1]
    }
