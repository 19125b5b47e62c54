"""Batched fits against `fit`, and against scipy on the same posterior written again with OpenCV's lens."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import least_squares

from tests.support.rigs import World, thesis_rig
from workbench.calibration.data.observations import Observation, as_grid, group
from workbench.calibration.estimation.batch import CHUNK, BatchFit, fit_batch
from workbench.calibration.estimation.fit import CalibrationFit, fit
from workbench.model.rig import Rig

STANDOFFS_MM = (125.0, 200.0, 330.0, 600.0, 1200.0, 2500.0, 4500.0)
SEEDS = (1, 2, 3, 4, 5, 6)
SOLVED_SD = 1e-6
"""What two solvers of one problem may differ by, in posterior standard deviations."""


def observations(rig: Rig, seed: int) -> list[Observation]:
    """Of even seeds, spots are missing at random, in one coordinate or in both."""
    seen = World(rig, seed).observations(STANDOFFS_MM, repeats=3)
    if seed % 2:
        return seen
    rng = np.random.default_rng([seed, 2])
    lost = {(s.laser_id, s.placement) for s in seen if rng.random() < 0.2}
    return [s for s in seen if (s.laser_id, s.placement) not in lost or s.placement == "600"]


@dataclass(frozen=True)
class Both:
    """The same calibrations by either solver."""

    single: list[CalibrationFit]
    batch: BatchFit


def both(rig: Rig, per_seed: list[list[Observation]]) -> Both:
    single = [fit(rig, seen) for seen in per_seed]
    grids = [as_grid(s.cells, len(rig.lasers)) for s in single]
    position, sd = (np.stack(part) for part in zip(*grids, strict=True))
    return Both(single, fit_batch(rig, single[0].cells.placements, position, sd))


@pytest.fixture(scope="module")
def solved() -> Both:
    rig = thesis_rig()
    return both(rig, [observations(rig, seed) for seed in SEEDS])


@pytest.mark.parametrize("index", range(len(SEEDS)), ids=[f"seed {s}" for s in SEEDS])
class TestAgainstFit:
    def test_values(self, solved: Both, index: int) -> None:
        single = solved.single[index]
        scale = np.where(single.sd > 0, single.sd, 1.0)
        assert solved.batch.converged[index]
        np.testing.assert_allclose(
            solved.batch.values[index] / scale, single.values / scale, rtol=0, atol=SOLVED_SD
        )

    def test_covariance(self, solved: Both, index: int) -> None:
        single, batch = solved.single[index], solved.batch
        np.testing.assert_allclose(batch.sd[index], single.sd, rtol=SOLVED_SD)
        sensor = single.sensor
        scale = np.where(single.sd > 0, single.sd, 1.0)[sensor]
        by_sd = np.outer(scale, scale)
        np.testing.assert_allclose(
            batch.sensor_covariance[index] / by_sd, single.covariance[sensor, sensor] / by_sd, atol=SOLVED_SD
        )

    def test_what_it_says_of_the_residuals(self, solved: Both, index: int) -> None:
        single, batch = solved.single[index], solved.batch
        assert batch.chi2[index] == pytest.approx(single.chi2, rel=1e-6)
        assert batch.degrees_of_freedom[index] == pytest.approx(single.degrees_of_freedom, abs=1e-5)
        assert batch.noise_scale[index] == pytest.approx(single.noise_scale, abs=1e-5)


def test_some_spots_are_missing(solved: Both) -> None:
    counts = [len(single.cells.laser) for single in solved.single]
    assert min(counts) < max(counts) == len(STANDOFFS_MM) * 4


@pytest.mark.parametrize("index", [0, 1], ids=["all seen", "some missing"])
def test_the_optimum_is_scipy_s(solved: Both, index: int) -> None:
    """Central differences are fine enough for 1e-6 of a standard deviation."""
    single, table = solved.single[index], solved.batch.table
    cells, free = single.cells, table.free
    world = World(single.rig, SEEDS[index])
    full = np.zeros(len(table.parameters))

    def residuals(y: np.ndarray) -> np.ndarray:
        full[free] = y
        values = table.prior_mean + table.prior_sd * full
        world.values = dict(zip((p.name for p in table.parameters), values.tolist(), strict=True))
        data = []
        for n, (laser, placement) in enumerate(zip(cells.laser, cells.placement, strict=True)):
            info = cells.placements[placement]
            error, *slopes = (
                world.values[f"{info.key}.{name}"] for name in ("error_mm", "slope_x", "slope_y")
            )
            z0 = info.standoff_mm * (1 + world.values["ruler_scale"]) + error + world.values["offset_mm"]
            pixel = world.pixel(single.rig.laser_ids[laser], z0, *(np.arctan(slopes) + world.common_tilt))
            data.append((pixel - cells.position_px[n]) / (single.noise_scale * cells.sd_px[n]))
        return np.concatenate([np.ravel(data), y])

    start = np.zeros(len(free))
    found = least_squares(residuals, start, jac="3-point", xtol=1e-15, ftol=1e-15, gtol=1e-12)
    sd = solved.batch.sd[index][free] / table.prior_sd[free]
    ours = (solved.batch.values[index] - table.prior_mean)[free] / table.prior_sd[free]
    np.testing.assert_allclose(ours / sd, found.x / sd, rtol=0, atol=SOLVED_SD)


@pytest.mark.parametrize("stated_px", [0.04, 1.2])
def test_noise_larger_than_stated(stated_px: float) -> None:
    """Spots three times as noisy as the rig says: both solvers enlarge the noise to the same."""
    loose = thesis_rig(noise_px=stated_px, speckle_px=stated_px)
    noisy = thesis_rig(noise_px=4 * stated_px, speckle_px=3 * stated_px)
    pair = both(loose, [World(noisy, seed).observations(STANDOFFS_MM, repeats=1) for seed in (11, 13)])
    for index, single in enumerate(pair.single):
        assert pair.batch.noise_scale[index] > 1.5
        assert pair.batch.noise_scale[index] == pytest.approx(single.noise_scale, rel=1e-6)
        np.testing.assert_allclose(pair.batch.sd[index], single.sd, rtol=1e-5)


def test_a_fit_does_not_depend_on_its_company() -> None:
    """More than a chunk, which is not full at its end: every fit comes back in its place."""
    rig = thesis_rig()
    cells, _ = group(World(rig, 1).observations(STANDOFFS_MM, repeats=2), rig.laser_ids, rig.noise)
    position, sd = as_grid(cells, len(rig.lasers))
    shifts = np.random.default_rng(4).normal(0.0, 0.03, (CHUNK + 3, *position.shape))
    together = fit_batch(rig, cells.placements, position + shifts, sd)
    for index in (0, CHUNK - 1, CHUNK + 2):
        alone = fit_batch(rig, cells.placements, (position + shifts[index])[None], sd)
        scale = np.where(alone.sd[0] > 0, alone.sd[0], 1.0)
        np.testing.assert_allclose(
            together.values[index] / scale, alone.values[0] / scale, rtol=0, atol=SOLVED_SD
        )
    assert together.converged.all()


def test_a_cell_that_no_calibration_saw_leaves_the_priors() -> None:
    rig = thesis_rig()
    cells, _ = group(World(rig, 1).observations(STANDOFFS_MM, repeats=1), rig.laser_ids, rig.noise)
    blind = fit_batch(rig, cells.placements, np.full((1, len(STANDOFFS_MM), 4, 2), np.nan), np.array(0.05))
    np.testing.assert_allclose(blind.values[0], blind.table.prior_mean, atol=1e-12)
    np.testing.assert_allclose(blind.sd[0], blind.table.prior_sd, rtol=1e-12)
    assert blind.degrees_of_freedom[0] == pytest.approx(0.0, abs=1e-9)
