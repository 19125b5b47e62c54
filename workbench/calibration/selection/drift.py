"""Drift of the image over a session: a score test, and the decision to fit it.

A mount that creeps or a camera that warms up shifts the image. Where standoffs are visited from near to far
the shift follows the standoff and is taken for baselines and pointing: residuals hardly show it. The test
is that of a missing trend (C. R. Rao, Proc. Camb. Phil. Soc. 44 (1948) 50). Let r be the residuals in
standard deviations, and R = 1 - J C J^T their covariance. W has a column for u and one for v: a shift of
1 px that is linear in the running time of the session. For each interruption W has two more, a step of 1 px
from each part of the session to the next, since the sensor may have cooled or been moved. The score `W^T r`
has the covariance S = W^T R W, so that `r^T W S^-1 W^T r` is chi-square without a shift, with two degrees
of freedom for each part. The estimates are `S^-1 W^T r`, with all other parameters free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.calibration.checks.hypotheses import explain_misfit
from workbench.calibration.data.boards import BoardView
from workbench.calibration.data.observations import Observation
from workbench.calibration.estimation.fit import CalibrationFit, fit
from workbench.calibration.estimation.refit import optimum_of, problem_of
from workbench.calibration.model.layout import Layout
from workbench.calibration.model.parameters import DRIFT, DRIFT_SD_PX, fits_drift
from workbench.model.arrays import FloatArray
from workbench.model.fit_event import Rejected
from workbench.model.prior import Prior
from workbench.model.rig import Rig
from workbench.model.stats import chi2_sf

SHOWN_P = 0.003
"""P value below which the drift is fitted."""
UNKNOWN_SHARE = 1e-6
"""Squared component of an axis in the unknown directions above which the axis is not estimated."""
LEAST_INFORMATION = 1e-6
"""Information on a drift, 1/px^2, below which the drift is not estimated."""


@dataclass(frozen=True)
class DriftTest:
    """Drift that the data show from the first capture to the last, and steps between interrupted parts."""

    shift_px: FloatArray
    """(K,) drift in u and v, then the steps between the parts likewise; 0 where it is not estimated."""
    sd_px: FloatArray
    """(K,) standard deviation; infinite where nothing is known."""
    p_value: float
    """Of neither drift nor steps; 1 where nothing is known."""
    score: float
    """Twice the log evidence of drift and steps against none."""


def drift_test(fitted: CalibrationFit) -> DriftTest:
    """Test a fit without a drift for one."""
    problem = problem_of(fitted)
    residual, jacobian = problem.linearise(optimum_of(fitted), fitted.noise_scale)
    sd = fitted.table.prior_sd
    covariance = fitted.covariance / np.outer(*(np.where(sd > 0, sd, np.inf),) * 2)
    shift = shift_columns(fitted)
    along = jacobian.T @ shift
    information = shift.T @ shift - along.T @ covariance @ along
    return score_test(information, -shift.T @ residual)


def shift_columns(fitted: CalibrationFit) -> FloatArray:
    """(R, 2 P) change of the residuals, in their deviations, with a drift of 1 px, then with each step."""
    data, parts = problem_of(fitted).data, fitted.cells.parts.shape[1]
    time = np.concatenate([np.asarray(data.spots.time, float), np.asarray(data.corners.time, float)])
    shares = np.concatenate([np.asarray(data.spots.parts, float), np.asarray(data.corners.parts, float)])
    offsets = shares @ Layout(fitted.rig.camera.lens, parts=parts).offsets_by_step
    inverse_sd = np.asarray(data.inverse_sd) / fitted.noise_scale
    by_axis = np.column_stack([time, offsets])[:, None] * inverse_sd[:, :, None]
    shift = np.zeros((2 * len(time), 2 * parts))
    shift[0::2, 0::2], shift[1::2, 1::2] = by_axis[:, 0], by_axis[:, 1]
    return shift


def score_test(information: FloatArray, score: FloatArray) -> DriftTest:
    """The test by the information on K shifts (K, K), 1/px^2, and its score (K,), 1/px.

    A shift is estimated only where the data constrain it completely. Where they determine one combination of
    u and v alone, the estimate of least norm would share it between them.
    """
    values, vectors = np.linalg.eigh(information)
    known = values > LEAST_INFORMATION
    inverse = (vectors[:, known] / values[known]) @ vectors[:, known].T
    chi2 = float(score @ inverse @ score)
    spread = np.eye(len(score)) + DRIFT_SD_PX**2 * information
    evidence = score @ np.linalg.solve(spread, DRIFT_SD_PX**2 * score) - np.linalg.slogdet(spread)[1]
    axis_known = (vectors[:, ~known] ** 2).sum(axis=1) < UNKNOWN_SHARE
    return DriftTest(
        shift_px=np.where(axis_known, inverse @ score, 0.0),
        sd_px=np.where(axis_known, np.sqrt(np.diag(inverse)), np.inf),
        p_value=float(chi2_sf(chi2, known.sum())) if known.any() else 1.0,
        score=float(evidence),
    )


def with_drift(rig: Rig) -> Rig:
    """The rig with the drift free."""
    free = {name: Prior(value=getattr(rig.bench, name).value, sd=DRIFT_SD_PX) for name in DRIFT}
    return rig.model_copy(update={"bench": rig.bench.model_copy(update=free)})


def fit_with_drift(
    rig: Rig,
    observations: Sequence[Observation],
    rejected: Sequence[Rejected] = (),
    boards: Sequence[BoardView] = (),
) -> CalibrationFit:
    """`fit`, with the drift free where the data show one and no named fault explains them better.

    Raises:
        BadInputError: as `fit`.
        LimitFailedError: as `fit`.
    """
    fitted = fit(rig, observations, rejected, boards)
    if drift_is_shown(fitted):
        return fit(with_drift(rig), observations, rejected, boards)
    return fitted


def drift_is_shown(fitted: CalibrationFit) -> bool:
    """Whether a fit without a drift needs one."""
    if fits_drift(fitted.rig):
        return False
    test = drift_test(fitted)
    if not test.p_value < SHOWN_P:
        return False
    faults = [h for h in explain_misfit(fitted) if h.kind != "spot"]
    return test.score > max((h.score for h in faults), default=0.0)
