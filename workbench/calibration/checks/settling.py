"""Settling of a drift: its time constant, and the warm-up that would have avoided it.

A camera that warms up shifts the image by a exp(-t / tau), t from 0 at the first capture of an
uninterrupted part of the session. A part has its own amplitude: after an interruption the camera may have
cooled, wholly or not at all. A steady drift of each part is the limit for a large tau, so that one
likelihood covers both. All parameters but the drift are marginalised, the steps between the parts among
them. The residuals r at the prior means, in standard deviations, have the covariance R = 1 + J J^T.

A shape of the drift has the columns W, one for u and one for v in each part. Of chi-square it explains

    gain(tau) = (W^T R^-1 r)^T (W^T R^-1 W)^-1 (W^T R^-1 r)

The amplitudes are those of least squares. The profile of gain over tau gives the estimate and its 95 %
interval. A time constant is stated where the steady drift is contradicted. Times are in durations of the
session without its interruptions. They are those of the captures, or where these have none their order,
taken to be evenly spaced.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, log

import numpy as np

from workbench.calibration.estimation.fit import CalibrationFit
from workbench.calibration.estimation.refit import optimum_of, problem_of
from workbench.calibration.model.parameters import STEP
from workbench.model.arrays import FloatArray
from workbench.model.number_text import duration
from workbench.model.stats import chi2_sf

TIME_CONSTANTS = np.geomspace(0.02, 20.0, 121)
"""Grid, in durations of the session: below, one capture in fifty shifts; above, the drift is steady."""
STEADY_GAIN = 6.63
"""Gain over the steady drift above which a time constant is stated: chi-square of one degree, 1 %."""
INTERVAL_GAIN = 3.84
"""Loss of gain at the ends of the 95 % interval."""
BY_ORDER = " The captures have no times (time_s); their order was used."
"""Sentence added to a remark on a drift whose time is an order."""
DRIFTS_P = 0.003
"""P value below which a drift within the parts is taken for real, beside the steps between them."""
LEAST_INFORMATION = 1e-6
"""Information on a drift, 1/px^2, below which its axis is not estimated."""


@dataclass(frozen=True)
class Settling:
    """Drift that settles exponentially; times in durations of the session."""

    time_constant: float
    interval: tuple[float, float]
    """95 %."""
    amplitude_px: float
    """Shift from the first capture of a part to the end of the settling, the largest of all parts."""

    def warm_up(self, limit_px: float) -> float:
        """Warm-up after which at most `limit_px` of the shift remains."""
        return max(0.0, self.time_constant * log(self.amplitude_px / limit_px))


@dataclass(frozen=True)
class DriftProfile:
    """Linearised residuals of a fit without its drift; R rows, two for each of M spots and corners."""

    residual: FloatArray
    """(R,) predicted - measured at the prior means, in standard deviations."""
    jacobian: FloatArray
    """(R, P) by all parameters but the drift, in units of their priors."""
    covariance: FloatArray
    """(P, P) of these parameters."""
    inverse_sd: FloatArray
    """(M, 2) 0 where a coordinate was not measured."""
    time: FloatArray
    """(M,) since the first capture of the part; without interruption 0 at the first, 1 at the last."""
    parts: FloatArray
    """(M, P) share of each part."""

    @classmethod
    def of(cls, fitted: CalibrationFit) -> DriftProfile:
        """Linearisation at the optimum of a fit with a drift."""
        problem, optimum = problem_of(fitted), optimum_of(fitted)
        residual, jacobian = problem.linearise(optimum, fitted.noise_scale)
        residual = residual - jacobian @ optimum
        drift = fitted.layout.drift
        jacobian = np.delete(jacobian, range(drift.start, drift.stop), axis=1)
        information = jacobian.T @ jacobian + np.eye(jacobian.shape[1])
        covariance = np.asarray(np.linalg.inv(information), np.float64)
        data = problem.data
        time = np.concatenate([np.asarray(data.spots.time, float), np.asarray(data.corners.time, float)])
        parts = np.concatenate([np.asarray(data.spots.parts, float), np.asarray(data.corners.parts, float)])
        inverse_sd = np.asarray(data.inverse_sd, np.float64) / fitted.noise_scale
        since = time - parts @ fitted.cells.times.limits[:, 0]
        return cls(residual, jacobian, covariance, inverse_sd, since, parts)

    def gain(self, shape: FloatArray) -> tuple[float, FloatArray]:
        """Gain of a drift of this shape (M,), and its amplitudes (P, 2) in u and v, px."""
        by_part = self.parts * shape[:, None]
        columns = np.zeros((len(self.residual), 2 * by_part.shape[1]))
        columns[0::2, 0::2] = by_part * self.inverse_sd[:, :1]
        columns[1::2, 1::2] = by_part * self.inverse_sd[:, 1:]
        along = self.jacobian.T @ columns
        information = columns.T @ columns - along.T @ self.covariance @ along
        score = along.T @ self.covariance @ (self.jacobian.T @ self.residual) - columns.T @ self.residual
        values, vectors = np.linalg.eigh(information)
        known = values > LEAST_INFORMATION
        amplitude = (vectors[:, known] / values[known]) @ vectors[:, known].T @ score
        return float(score @ amplitude), np.asarray(amplitude, np.float64).reshape(-1, 2)


def settling_of(profile: DriftProfile) -> Settling | None:
    """Time constant of the drift that a fit has; None where the drift is steady, or hidden by the order."""
    gains = np.array([profile.gain(np.exp(-profile.time / tau))[0] for tau in TIME_CONSTANTS])
    best = int(np.argmax(gains))
    if gains[best] < profile.gain(profile.time)[0] + STEADY_GAIN:
        return None
    inside = np.flatnonzero(gains >= gains[best] - INTERVAL_GAIN)
    _, amplitude_px = profile.gain(np.exp(-profile.time / TIME_CONSTANTS[best]))
    low, high = TIME_CONSTANTS[inside[[0, -1]]].tolist()
    return Settling(float(TIME_CONSTANTS[best]), (low, high), float(np.hypot(*amplitude_px.T).max()))


def drift_advice(fitted: CalibrationFit) -> str:
    """Advice in words for a fit with a drift: on a step between parts of the session, or on the warm-up."""
    profile = DriftProfile.of(fitted)
    if fitted.layout.parts > 1 and not drifts_within_parts(profile):
        return _step_advice(fitted)
    return _warm_up_advice(fitted, settling_of(profile))


def drifts_within_parts(profile: DriftProfile) -> bool:
    """Whether the image drifts within the parts, steadily or settling, apart from the steps between them."""
    shapes = [profile.time, *(np.exp(-profile.time / tau) for tau in TIME_CONSTANTS)]
    gain = max(profile.gain(shape)[0] for shape in shapes)
    return float(chi2_sf(gain, 2 * profile.parts.shape[1])) < DRIFTS_P


def _step_advice(fitted: CalibrationFit) -> str:
    """Advice on the most significant step of the image between two parts of the session."""
    layout = fitted.layout
    steps_px = fitted.values[layout.steps].reshape(-1, len(STEP))
    sd_px = np.sqrt(np.diag(fitted.covariance)[layout.steps]).reshape(-1, len(STEP))
    number = int(np.argmax((steps_px**2 / sd_px**2).sum(axis=1)))
    u, v = steps_px[number].tolist()
    return (
        f"It is a step by {u:+.2g} px in u and {v:+.2g} px in v between parts {number + 1} and {number + 2}"
        " of the session, and no drift within a part: at this interruption sensor, lens or camera was touched"
        " or turned. Do: fix them, leave them alone until the last capture, or calibrate in one part"
    )


def _warm_up_advice(fitted: CalibrationFit, found: Settling | None) -> str:
    """Duration of the warm-up, or that the drift has not settled."""
    duration_s = fitted.cells.times.duration_s
    by_order = "" if isfinite(duration_s) else BY_ORDER
    if found is None:
        return (
            f"No settling shows: it takes longer than the session.{by_order} Do: warm up longer, or fix the"
            " camera"
        )
    # A shift below the deviation of a single mean position is one that no spot shows.
    limit_px = float(np.nanmedian(fitted.cells.sd_px)) * fitted.noise_scale
    low, high = found.interval
    if isfinite(duration_s):
        constant_s, low_s, high_s = (duration_s * one for one in (found.time_constant, low, high))
        return (
            f"It settles with a time constant of {duration(constant_s)} ({duration(low_s)} to"
            f" {duration(high_s)}), by {found.amplitude_px:.2g} px in all. Do: let the camera warm up for"
            f" {duration(duration_s * found.warm_up(limit_px))} before the first capture"
        )
    return (
        f"It settles with a time constant of {found.time_constant:.2g} ({low:.2g} to {high:.2g}) of the"
        f" session, by {found.amplitude_px:.2g} px in all.{by_order} Do: let the camera warm up for"
        f" {found.warm_up(limit_px):.2g} times the duration of this session before the first capture"
    )
