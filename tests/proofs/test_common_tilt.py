"""A square flat ranged after calibrations on a bench whose target stood tilted at every placement."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.proofs import simulate, study
from tests.proofs.ranging import ranges
from tests.support.rigs import STANDOFFS_MM
from tests.support.statistics import spread
from workbench.calibration.estimation.batch import fit_batch
from workbench.model.arrays import FloatArray
from workbench.model.rig import Rig, load_rig

RIG = load_rig(Path(__file__).parents[2] / "rigs/thesis-emulated.yaml")
FITS = 200
FLAT_MM = 250.0


def stating(yaw_deg: float, sd_deg: float) -> Rig:
    """The thesis's rig with another statement of the common tilt."""
    tilt = {"target_yaw_deg": yaw_deg, "target_tilt_sd_deg": sd_deg}
    return RIG.model_copy(update={"bench": RIG.bench.model_copy(update=tilt)})


def incline_z(true: Rig, stated: Rig, seed: int) -> FloatArray:
    """(n,) slope of a square flat in its stated deviations, by calibrations of sensors drawn from `true`.

    Spots by linear algebra and OpenCV's lens; the slope by least squares over the lasers' designed places.
    """
    standoffs, rng = np.array(STANDOFFS_MM), np.random.default_rng(seed)
    data = simulate.calibrations(true, standoffs, 10, FITS, rng)
    fitted = fit_batch(stated, study.placements(stated, standoffs), data.position_px, data.sd_px)
    z0 = FLAT_MM + data.truth[:, [simulate.lens_size(true)]]
    sd_px = float(np.hypot(stated.noise.spot_sd_px, stated.noise.speckle_sd_px))
    spots = simulate.spots(true, data.truth, z0, np.zeros((FITS, 1, 2)))
    spots = spots + rng.normal(0.0, sd_px, spots.shape)
    found = ranges(stated, fitted.sensor, fitted.sensor_covariance, spots, np.full(FITS, sd_px))
    x_mm = np.array([laser.x_mm.value for laser in stated.lasers])
    per_mm = x_mm / (x_mm @ x_mm)  # their mean is 0
    slope = found.range_mm[:, 0] @ per_mm
    gradient = np.einsum("l,nls->ns", per_mm, found.gradient[:, 0])
    variance = np.einsum("ns,nst,nt->n", gradient, fitted.sensor_covariance, gradient)
    z = slope / np.sqrt(variance + found.spot_sd_mm[:, 0] ** 2 @ per_mm**2)
    return np.asarray(z[np.isfinite(z)])


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(("yaw_deg", "sd_deg"), [(0.0, 0.5), (1.0, 0.2), (-8.0, 0.5)])
def test_a_square_flat_is_no_incline_whatever_tilt_was_stated(
    yaw_deg: float, sd_deg: float, seed: int
) -> None:
    rig = stating(yaw_deg, sd_deg)
    z = incline_z(rig, rig, seed)
    assert len(z) > 0.9 * FITS
    assert np.mean(np.abs(z) < 1.96) == pytest.approx(0.95, abs=spread(0.95, len(z)))


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_unmeasured_tilt_of_one_degree_is_no_incline(seed: int) -> None:
    """Two deviations of its prior: the remaining tilt is within the interval; held at 0 it is not."""
    true = stating(1.0, 0.0)
    z, held = incline_z(true, RIG, seed), incline_z(true, stating(0.0, 0.0), seed)
    assert np.mean(np.abs(z) < 1.96) > 0.8
    assert np.mean(np.abs(held) < 1.96) < 0.2
