"""Maximum a posteriori fit of a scanning head to its spots on a flat, with its covariance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from math import radians

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from workbench.calibration.data.observations import PlacementInfo
from workbench.calibration.estimation.fit import data_share
from workbench.calibration.estimation.gauss_newton import gauss_newton
from workbench.calibration.estimation.noise_scale import significant_scale
from workbench.calibration.model.parameters import ParameterTable
from workbench.calibration.scanning.prediction import HeadData, head_table, predict_head_spots
from workbench.model.arrays import FloatArray, IndexArray
from workbench.model.errors import BadInputError, LimitFailedError
from workbench.model.lens import LensName
from workbench.model.rig import Rig

STEPS = 12
"""Gauss-Newton steps; from the priors' means six reach rounding."""
CONVERGED = 1e-4
"""Largest further step, in standard deviations of the posterior."""
MAX_SCALE_ROUNDS = 5
SCALE_TOLERANCE = 1.001
"""The noise scale has converged where the residuals ask for less than this factor more."""


@dataclass(frozen=True)
class HeadSpots:
    """Mean positions of the head's spot, N moves at J placements."""

    placements: tuple[PlacementInfo, ...]
    placement: IndexArray
    """(N,) index of the placement."""
    reading_deg: FloatArray
    """(N,) reading of the encoder."""
    position_px: FloatArray
    """(N, 2)"""
    sd_px: FloatArray
    """(N, 2) 1 sigma, without the noise of the reading."""

    @property
    def data(self) -> HeadData:
        """Inputs of the prediction."""
        standoffs = np.array([one.standoff_mm for one in self.placements])
        return HeadData(self.placement, np.radians(self.reading_deg), standoffs[self.placement])


@dataclass(frozen=True)
class HeadFit:
    """Fitted head: P parameters (`head_table`), N moves; sd are 1 sigma."""

    rig: Rig
    table: ParameterTable
    spots: HeadSpots
    values: FloatArray
    """(P,) maximum a posteriori."""
    covariance: FloatArray
    """(P, P) posterior."""
    data_share: FloatArray
    """(P,) see `calibration.estimation.fit.data_share`."""
    residual_px: FloatArray
    """(N, 2) measured - predicted."""
    residual_sd_px: FloatArray
    """(N, 2) 1 sigma of spot and reading, as stated."""
    noise_scale: float
    """Factor on the stated noise, estimated from the residuals; 1 where they agree with it."""
    chi2: float
    """Of the data at the stated noise."""
    degrees_of_freedom: float

    @property
    def sd(self) -> FloatArray:
        """(P,) posterior standard deviations."""
        return np.sqrt(np.diag(self.covariance))


def fit_head(rig: Rig, spots: HeadSpots) -> HeadFit:
    """Fit lens, axis and encoder to the spots of a head on a flat at known standoffs.

    Errors and tilts of the placements are parameters, as in `estimation.fit`. The error of a reading is
    common to both coordinates. With g the derivative of a position by the angle and s the deviation of a
    reading, its covariance is that of the spot plus g g^T s^2.

    Raises:
        BadInputError: the rig has no head, or there are no spots.
        LimitFailedError: the result is not finite, or the iteration does not converge.
    """
    if not len(spots.placement):
        raise BadInputError("scanning head: no spot is left to fit; check exposure, angles and standoffs")
    table = _table(rig, spots.placements)
    problem = _Problem.of(rig, table, spots)
    wanted = 1.0
    for _ in range(MAX_SCALE_ROUNDS):
        scale = wanted
        y, jacobian, chi2 = problem.solve(scale)
        information = jacobian.T @ jacobian
        covariance = np.linalg.inv(information + np.eye(len(information)))
        freedom = 2 * len(spots.placement) - float(np.trace(information @ covariance))
        wanted = float(significant_scale(chi2, freedom))
        if not wanted > scale * SCALE_TOLERANCE:
            break
    residual, residual_sd = problem.residuals(y)
    return HeadFit(
        rig=rig,
        table=table,
        spots=spots,
        values=table.prior_mean + table.prior_sd * y,
        covariance=covariance * np.outer(table.prior_sd, table.prior_sd),
        data_share=data_share(jacobian, table),
        residual_px=residual,
        residual_sd_px=residual_sd,
        noise_scale=scale,
        chi2=chi2,
        degrees_of_freedom=freedom,
    )


def _table(rig: Rig, placements: Sequence[PlacementInfo]) -> ParameterTable:
    """Parameters, with the stated uncertainty of a standoff where there is one."""
    table = head_table(rig, [one.key for one in placements])
    usual = rig.bench.placement_sd_mm
    names = [parameter.name for parameter in table.parameters]
    for one in placements:
        if np.isfinite(one.standoff_sd_mm) and usual > 0:
            at = np.array([names.index(f"{one.key}.error_mm")])
            table = table.with_wider_priors(at, one.standoff_sd_mm / usual)
    return table


@dataclass(frozen=True)
class _Problem:
    """Least-squares problem, in units of the priors."""

    rig: Rig
    mean: FloatArray
    sd: FloatArray
    spots: HeadSpots
    reading_sd_rad: float

    @classmethod
    def of(cls, rig: Rig, table: ParameterTable, spots: HeadSpots) -> _Problem:
        return cls(rig, table.prior_mean, table.prior_sd, spots, radians(rig.scanning_head.reading_sd_deg))

    def solve(self, scale: float) -> tuple[FloatArray, FloatArray, float]:
        """Solution y (P,), derivatives (2 N, P) of the whitened residuals, and chi2 at the stated noise.

        Raises:
            LimitFailedError: the result is not finite, or the iteration does not converge.
        """
        size = len(self.mean)

        def linearise(y: FloatArray) -> tuple[FloatArray, FloatArray]:
            residual, jacobian = self._whitened(y, scale)
            return np.concatenate([residual, y]), np.vstack([jacobian, np.eye(size)])

        try:
            y = gauss_newton(linearise, np.zeros(size), STEPS)
            residual, jacobian = self._whitened(y, scale)
        except np.linalg.LinAlgError:
            residual = np.array([np.nan])
        if not np.isfinite(residual).all():
            raise LimitFailedError(
                "scanning head: the fit has no finite result; the spots contradict the rig file: check the"
                " position and the zero of the head, and the sign of its angle"
            )
        covariance = np.linalg.inv(jacobian.T @ jacobian + np.eye(size))
        step = covariance @ (jacobian.T @ residual + y)
        if not (np.abs(step) < CONVERGED * np.sqrt(np.diag(covariance))).all():
            raise LimitFailedError(
                f"scanning head: the fit does not converge in {STEPS} steps; the spots contradict the rig"
                " file: check the position and the zero of the head, and the sign of its angle"
            )
        return y, jacobian, float(residual @ residual) * scale**2

    def residuals(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Measured - predicted (N, 2), and the stated deviations (N, 2)."""
        predicted, _, by_reading = self._linearised(y)
        sd = np.hypot(self.spots.sd_px, self.reading_sd_rad * by_reading)
        return self.spots.position_px - predicted, sd

    def _whitened(self, y: FloatArray, scale: float) -> tuple[FloatArray, FloatArray]:
        """Predicted - measured (2 N,) and derivatives (2 N, P), whitened by the positions' covariances."""
        predicted, jacobian, by_reading = self._linearised(y)
        turn = self.reading_sd_rad * by_reading
        covariance = self.spots.sd_px[:, :, None] ** 2 * np.eye(2) + turn[:, :, None] * turn[:, None, :]
        root = scale * np.linalg.cholesky(covariance)
        residual = np.linalg.solve(root, (predicted - self.spots.position_px)[:, :, None])
        return residual.ravel(), np.linalg.solve(root, jacobian).reshape(residual.size, -1)

    def _linearised(self, y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Predicted positions (N, 2), their derivatives by y (N, 2, P) and by the reading (N, 2), px/rad."""
        found = _linearised(self.mean, self.sd, jnp.asarray(y), self.spots.data, self.rig.camera.lens)
        predicted, jacobian, by_reading = (np.asarray(part) for part in found)
        return predicted, jacobian, by_reading


@partial(jax.jit, static_argnames="lens_name")
def _linearised(
    mean: Array, sd: Array, y: Array, data: HeadData, lens_name: LensName
) -> tuple[Array, Array, Array]:
    def predicted(y: Array, turn: Array) -> Array:
        turned = data._replace(reading_rad=data.reading_rad + turn)
        return predict_head_spots(mean + sd * y, lens_name, turned)

    zero = jnp.zeros(())
    by_y, by_turn = jax.jacfwd(predicted, argnums=(0, 1))(y, zero)
    return predicted(y, zero), by_y, by_turn
