"""A batch of fits over a loop of scipy.optimize.least_squares on the same residuals; run by `calibration`.

One core, one process, one run; processor time. Both start at the prior means and minimise the same sum of
squares: 23 free parameters of the sensor, 33 of the placements, spots averaged over their repeats.
"""

from __future__ import annotations

import os

# Read when the numerical libraries load.
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["OMP_NUM_THREADS"] = "1"

import json
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from tests.proofs import simulate, study
from workbench.calibration.estimation.batch import BatchFit, fit_batch
from workbench.model.arrays import FloatArray
from workbench.model.rig import Rig, load_rig

ROOT = Path(__file__).parents[2]
STANDOFFS_MM = np.array([125.0, 160, 210, 280, 400, 600, 900, 1400, 2200, 3200, 4500])
FITS = 2000
LOOP = 40
POLISH = 12
Residuals = Callable[[FloatArray], FloatArray]


def residuals_of(batch: BatchFit, rig: Rig, position: FloatArray, sd: FloatArray, scale: float) -> Residuals:
    """Residuals of one calibration in numpy, (spots seen + free parameters,), in standard deviations."""
    table = batch.table
    free, mean, prior_sd = table.free, table.prior_mean, table.prior_sd
    lasers = len(rig.lasers)
    seen = np.isfinite(position)
    measured, weight = position[seen], 1.0 / (scale * sd[seen])
    common = simulate.lens_size(rig) + len(simulate.BENCH)
    sensor = common + 4 * lasers

    def residuals(y: FloatArray) -> FloatArray:
        values = mean.astype(y.dtype)
        values[free] += prior_sd[free] * y
        f, cx, cy, k1, k2, p1, p2, k3, offset, scale, common_x, common_y, _, _ = values[:common]
        x, y0, tx, ty = values[common:sensor].reshape(lasers, 4).T
        error, slope_x, slope_y = values[sensor:].reshape(-1, 3, 1).swapaxes(0, 1)
        slope_x = (slope_x + common_x) / (1.0 - slope_x * common_x)
        slope_y = (slope_y + common_y) / (1.0 - slope_y * common_y)
        z0 = STANDOFFS_MM[:, None] * (1.0 + scale) + error + offset
        w = (1.0 - slope_x * tx - slope_y * ty) / (z0 + slope_x * x + slope_y * y0)
        u, v = tx + x * w, ty + y0 * w
        r2 = u * u + v * v
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        predicted = np.empty((*w.shape, 2), y.dtype)
        predicted[..., 0] = cx + f * (u * radial + 2.0 * p1 * u * v + p2 * (r2 + 2.0 * u * u))
        predicted[..., 1] = cy + f * (v * radial + p1 * (r2 + 2.0 * v * v) + 2.0 * p2 * u * v)
        return np.concatenate([(predicted[seen] - measured) * weight, y])

    return residuals


def polished(residuals: Residuals, y: FloatArray) -> FloatArray:
    """The optimum near `y` to the last digits: Gauss-Newton with derivatives by complex steps."""
    for _ in range(POLISH):
        jacobian = np.stack([residuals(y + 1e-30j * axis).imag / 1e-30 for axis in np.eye(len(y))], axis=1)
        y = y - np.linalg.lstsq(jacobian, residuals(y))[0]
    return y


def ours(batch: BatchFit, index: int) -> FloatArray:
    """(free,) one optimum of the batch in units of the priors."""
    table, free = batch.table, batch.table.free
    return np.asarray((batch.values[index, free] - table.prior_mean[free]) / table.prior_sd[free])


def distance_sd(batch: BatchFit, index: int, a: FloatArray, b: FloatArray) -> float:
    """Largest difference of a parameter between two optima, in posterior standard deviations."""
    free = batch.table.free
    return float(np.abs((a - b) * batch.table.prior_sd[free] / batch.sd[index, free]).max())


def peak_gib() -> float:
    """Largest memory of this process, GiB; `ru_maxrss` begins at that of the process which started it."""
    (line,) = [x for x in Path("/proc/self/status").read_text().splitlines() if x.startswith("VmHWM:")]
    return int(line.split()[1]) / 1024**2


def main() -> None:
    """Print the figures as JSON."""
    # JAX counts its cores at its first use, which is below: one, as numpy's.
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    rig = load_rig(ROOT / "rigs/thesis-emulated.yaml")
    data = simulate.calibrations(rig, STANDOFFS_MM, 10, FITS, np.random.default_rng(8))
    placements = study.placements(rig, STANDOFFS_MM)

    begin = time.process_time()
    batch = fit_batch(rig, placements, data.position_px, data.sd_px)
    first = time.process_time() - begin
    rounds = []
    for _ in range(3):
        begin = time.process_time()
        batch = fit_batch(rig, placements, data.position_px, data.sd_px)
        rounds.append((time.process_time() - begin) / FITS)
    peak = peak_gib()

    scales = batch.noise_scale
    tasks = [residuals_of(batch, rig, data.position_px[i], data.sd_px[i], scales[i]) for i in range(LOOP)]
    start = np.zeros(len(batch.table.free))
    begin = time.process_time()
    loop = [least_squares(task, start).x for task in tasks]
    scipy_s = (time.process_time() - begin) / LOOP
    optima = [polished(task, found) for task, found in zip(tasks, loop, strict=True)]
    figures = {
        "ours_s": min(rounds),
        "compile_s": first - FITS * min(rounds),
        "scipy_s": scipy_s,
        "peak_gib": peak,
        "ours_off_sd": max(distance_sd(batch, i, ours(batch, i), y) for i, y in enumerate(optima)),
        "scipy_off_sd": max(
            distance_sd(batch, i, x, y) for i, (x, y) in enumerate(zip(loop, optima, strict=True))
        ),
        "converged": bool(batch.converged.all()),
    }
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
