"""The least that does the fit of `workbench fit`: numpy, scipy.optimize, priors of rigs/thesis-emulated.yaml.

    python minimal_fit.py captures.csv calibration.yaml

A script, not a module: what it imports and when is what is compared.
"""

import csv
import sys
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from workbench.model.arrays import FloatArray

BASELINES_MM = (-60.0, -30.0, 30.0, 60.0)
TILT_SD = np.radians(0.5)
MEAN = np.array([533.3, 319.5, 239.5, 0, 0, 0, 0, 0, 0, *(n for x in BASELINES_MM for n in (x, 0, 0, 0))])
SD = np.array([26.7, 40, 40, 0.3, 0.3, 5, 0.0005, TILT_SD, TILT_SD] + 4 * [0.2, 0.2, 0.005, 0.005])
PLACEMENT_SD = np.array([0.3, TILT_SD, TILT_SD])
SPOT_SD, SPECKLE_SD = 0.05, 0.037
LASERS = ("L1", "L2", "L3", "L4")

with Path(sys.argv[1]).open(newline="") as file:
    rows = list(csv.DictReader(file))
standoffs = np.array(sorted({float(row["standoff_mm"]) for row in rows}))
cells: dict[tuple[int, int], list[tuple[float, float]]] = {}
for row in rows:
    placement = int(np.searchsorted(standoffs, float(row["standoff_mm"])))
    cells.setdefault((placement, LASERS.index(row["laser_id"])), []).append(
        (float(row["u_px"]), float(row["v_px"]))
    )
placement, laser = np.array(list(cells)).T
position = np.array([np.mean(seen, axis=0) for seen in cells.values()])
sd = np.hypot(SPOT_SD / np.sqrt([len(seen) for seen in cells.values()]), SPECKLE_SD)[:, None]
mean = np.concatenate([MEAN, np.zeros(3 * len(standoffs))])
prior_sd = np.concatenate([SD, np.tile(PLACEMENT_SD, len(standoffs))])


def residuals(y: FloatArray) -> FloatArray:
    """Spots, then priors, in standard deviations."""
    values = mean + prior_sd * y
    f, cx, cy, k1, k2, offset, scale, common_x, common_y = values[:9]
    x, y0, tx, ty = values[9:25].reshape(4, 4)[laser].T
    error, slope_x, slope_y = values[25:].reshape(-1, 3)[placement].T
    slope_x = (slope_x + common_x) / (1 - slope_x * common_x)
    slope_y = (slope_y + common_y) / (1 - slope_y * common_y)
    z0 = standoffs[placement] * (1 + scale) + error + offset
    w = (1 - slope_x * tx - slope_y * ty) / (z0 + slope_x * x + slope_y * y0)
    u, v = tx + x * w, ty + y0 * w
    r2 = u * u + v * v
    radial = 1 + r2 * (k1 + r2 * k2)
    predicted = np.stack([cx + f * u * radial, cy + f * v * radial], axis=1)
    return np.concatenate([((predicted - position) / sd).ravel(), y])


found = least_squares(residuals, np.zeros(len(mean)))
values = mean + prior_sd * found.x
jacobian = np.asarray(found.jac, float)
covariance = np.linalg.inv(jacobian.T @ jacobian) * np.outer(prior_sd, prior_sd)
with Path(sys.argv[2]).open("w") as file:
    file.write("values: [" + ", ".join(map(repr, values[:25].tolist())) + "]\n")
    file.write("covariance: [" + ", ".join(map(repr, covariance[:25, :25].ravel().tolist())) + "]\n")
