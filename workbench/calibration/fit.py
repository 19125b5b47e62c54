"""The fit: maximum a posteriori by non-linear least squares, and its covariance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import radians, tan

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jax import Array
from numpy.typing import NDArray

from workbench.calibration.missing import name_out_of_frame
from workbench.calibration.observations import Cells, PlacementInfo, Rejected, Sighting, group, positions
from workbench.calibration.parameters import (
    LENS,
    PLACEMENT,
    RAY,
    REFERENCE,
    Parameter,
    ParameterTable,
    placement_parameters,
    sensor_parameters,
)
from workbench.calibration.prediction import predict_cell
from workbench.calibration.scatter import scale_called_for
from workbench.model.errors import BadInputError, LimitFailedError
from workbench.model.rig import Prior, Rig

FloatArray = NDArray[np.float64]
FLAT_PRIOR_SD = 1e3
"""A prior this many times wider than stated is as good as none."""


@dataclass(frozen=True)
class Fit:
    """A fitted calibration. P parameters (sensor first, then placements), N cells, 1 sigma throughout."""

    rig: Rig
    table: ParameterTable
    cells: Cells
    rejected: tuple[Rejected, ...]
    values: FloatArray
    """(P,) maximum a posteriori."""
    covariance: FloatArray
    """(P, P) posterior."""
    prior_pull: FloatArray
    """(P,) value - prior mean in units of the prior's sd; 0 for constants."""
    data_share: FloatArray
    """(P,) see `data_share`."""
    residual_px: FloatArray
    """(N, 2) measured - predicted mean positions; NaN where not measured."""
    rms_px: float
    """Over all single positions used, not over the means."""
    noise_scale: float
    """Factor on the stated pixel noise that the residuals called for; 1 where they agree with it."""
    chi2: float
    """Of the data at the stated noise."""
    degrees_of_freedom: float
    """Data minus the effective number of parameters that they determine."""
    converged: bool

    @property
    def sd(self) -> FloatArray:
        """(P,) posterior standard deviations."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def used(self) -> tuple[Sighting, ...]:
        """Every sighting that the fit rests on."""
        return tuple(s for members in self.cells.members for s in members)

    @property
    def sensor(self) -> slice:
        """Where the sensor's parameters stand among all."""
        return slice(0, int(self.table.is_sensor.sum()))


def fit(rig: Rig, sightings: Sequence[Sighting], rejected: Sequence[Rejected] = ()) -> Fit:
    """Fit the rig's parameters to sightings of a flat target.

    The estimate maximises the posterior of Gaussian noise and the rig's Gaussian priors. Placement errors and
    tilts are parameters with priors, so that repeats at one placement count as what they are: one placement.
    Where the residuals are significantly larger than the stated noise, the noise is scaled to them (with the
    effective number of parameters taken off) and the fit repeated.

    Args:
        rig: priors and noise.
        sightings: spots at known standoffs.
        rejected: what was already rejected before, to be listed with the fit's own.

    Raises:
        BadInputError: no sightings, one of a laser that the rig does not have, placements that contradict
            themselves, or a target that the rig file puts behind the pinhole.
        LimitFailedError: the fit does not come to a finite result.
    """
    _check(rig, sightings)
    cells, strays = group(sightings, rig.laser_ids, rig.noise)
    table = table_of(rig, cells.placements)
    problem = _Problem.of(rig, table, cells)
    scale = 1.0
    with np.errstate(over="ignore", invalid="ignore"):  # a result that is not finite is refused by name
        for _ in range(10):
            solution = problem.solve(scale)
            if not solution.scale_called_for > scale * 1.001:
                break
            scale = solution.scale_called_for
    if not np.isfinite([*solution.y, *np.diag(solution.covariance), solution.chi2]).all():
        raise LimitFailedError(
            "the fit does not come to a finite result: the positions contradict the rig file altogether;"
            " check its baselines, standoffs and image size"
        )
    values = table.prior_mean + table.prior_sd * solution.y
    residual = solution.residual_px
    return Fit(
        rig=rig,
        table=table,
        cells=cells,
        rejected=(*name_out_of_frame(rig, values, rejected), *strays),
        values=values,
        covariance=solution.covariance * np.outer(table.prior_sd, table.prior_sd),
        prior_pull=np.where(table.prior_sd > 0, solution.y, 0.0),
        data_share=data_share(solution.jacobian, table),
        residual_px=residual,
        rms_px=_rms(cells, residual),
        noise_scale=scale,
        chi2=solution.chi2,
        degrees_of_freedom=solution.degrees_of_freedom,
        converged=solution.converged,
    )


def data_share(jacobian: FloatArray, table: ParameterTable) -> FloatArray:
    """Share of each parameter's information that the data give by themselves, (P,).

    For parameter i: J_i / (J_i + 1 / prior_sd_i^2), where J_i is the information on i in the data when no
    other parameter of the sensor has a prior. A focal length that comes out sharp only because the baselines
    were measured with a calliper has a share of 0: the data fix the product, the calliper the factor. Errors
    of placement and tilt keep their priors, being the noise of the standoffs.

    Args:
        jacobian: (M, P) derivatives of the data's residuals (in sd) by the parameters (in prior sd).
        table: the parameters.
    """
    sensor = table.is_sensor
    by_sensor, by_placement = jacobian[:, sensor], jacobian[:, ~sensor]
    noise = np.eye(len(jacobian)) + by_placement @ by_placement.T
    information = by_sensor.T @ np.linalg.solve(noise, by_sensor)
    share = np.zeros(len(sensor))
    # Every prior widened to (almost) none; the parameter's own is then put back by the formula.
    variance = np.diag(np.linalg.inv(information + np.eye(len(information)) / FLAT_PRIOR_SD**2))
    share[sensor] = np.where(table.prior_sd[sensor] > 0, 1.0 / (1.0 + variance), 0.0)
    return share


@dataclass(frozen=True)
class _Solution:
    y: FloatArray
    jacobian: FloatArray
    covariance: FloatArray
    residual_px: FloatArray
    chi2: float
    degrees_of_freedom: float
    scale_called_for: float
    converged: bool


@dataclass(frozen=True)
class _Problem:
    """The numbers of one fit, ready for JAX."""

    mean: FloatArray
    sd: FloatArray
    laser: NDArray[np.intp]
    placement: NDArray[np.intp]
    standoff_mm: FloatArray
    position_px: FloatArray
    inverse_sd: FloatArray
    """(N, 2), 0 where a coordinate was not measured."""
    lasers: int

    @classmethod
    def of(cls, rig: Rig, table: ParameterTable, cells: Cells) -> _Problem:
        measured = np.isfinite(cells.position_px)
        return cls(
            mean=table.prior_mean,
            sd=table.prior_sd,
            laser=cells.laser,
            placement=cells.placement,
            standoff_mm=np.array([p.standoff_mm for p in cells.placements]),
            position_px=np.where(measured, cells.position_px, 0.0),
            inverse_sd=np.where(measured, 1.0 / cells.sd_px, 0.0),
            lasers=len(rig.lasers),
        )

    def solve(self, scale: float) -> _Solution:
        """Solve with the pixel noise `scale` times what was stated."""
        arrays = (self.mean, self.sd, self.laser, self.placement, self.standoff_mm, self.position_px)
        args = (*arrays, self.inverse_sd / scale)
        y, converged = _solve(args, self.lasers)
        residual, jacobian = (np.asarray(part) for part in _linearise(y, args, self.lasers))
        information = jacobian.T @ jacobian
        covariance = np.linalg.inv(information + np.eye(len(information)))
        count = int((self.inverse_sd > 0).sum())
        freedom = count - float(np.trace(information @ covariance))
        chi2 = float(residual @ residual) * scale**2
        pixels = -residual.reshape(-1, 2) / np.where(self.inverse_sd > 0, self.inverse_sd / scale, np.nan)
        return _Solution(
            y=np.asarray(y),
            jacobian=jacobian,
            covariance=covariance,
            residual_px=pixels,
            chi2=chi2,
            degrees_of_freedom=freedom,
            scale_called_for=float(scale_called_for(chi2, freedom)),
            converged=bool(converged),
        )


@partial(jax.jit, static_argnums=1)
def _solve(args: tuple[Array, ...], lasers: int) -> tuple[Array, Array]:
    """(P,) optimum in units of the prior, and whether the solver converged."""

    def residuals(y: Array, args: tuple[Array, ...]) -> Array:
        return jnp.concatenate([_data_residual(y, args, lasers), y])

    solver: optx.LevenbergMarquardt[Array, Array, None] = optx.LevenbergMarquardt(rtol=1e-10, atol=1e-10)
    start = jnp.zeros_like(args[0])
    solution: optx.Solution[Array, None] = optx.least_squares(
        residuals, solver, start, args, max_steps=200, throw=False
    )
    return solution.value, jnp.asarray(solution.result == optx.RESULTS.successful)


@partial(jax.jit, static_argnums=2)
def _linearise(y: Array, args: tuple[Array, ...], lasers: int) -> tuple[Array, Array]:
    """Residuals of the data (M,) and their derivatives (M, P), both in standard deviations."""
    return (
        _data_residual(y, args, lasers),
        jax.jacfwd(_data_residual)(y, args, lasers),
    )


def _data_residual(y: Array, args: tuple[Array, ...], lasers: int) -> Array:
    """(2 N,) predicted - measured positions in standard deviations; 0 where not measured."""
    mean, sd, laser, placement, standoff_mm, position_px, inverse_sd = args
    predicted = predict(mean + sd * y, lasers, laser, placement, standoff_mm)
    return ((predicted - position_px) * inverse_sd).ravel()


def predict(values: Array, lasers: int, laser: Array, placement: Array, standoff_mm: Array) -> Array:
    """(N, 2) pixel positions of laser `laser[n]` on the target of placement `placement[n]`.

    Args:
        values: (P,) parameters in the order of `sensor_parameters`, then `placement_parameters`.
        lasers: how many lasers there are.
        laser: (N,) index of the laser.
        placement: (N,) index of the placement.
        standoff_mm: standoffs of all placements by the ruler.
    """
    common = len(LENS) + len(REFERENCE)
    sensor_end = common + len(RAY) * lasers
    rays = values[common:sensor_end].reshape(lasers, len(RAY))[laser]
    errors = values[sensor_end:].reshape(-1, len(PLACEMENT))[placement]
    u, v = predict_cell((*values[:common], *rays.T, *errors.T), standoff_mm[placement])
    return jnp.stack([u, v], axis=1)


def table_of(rig: Rig, placements: Sequence[PlacementInfo]) -> ParameterTable:
    """All parameters of a fit: the sensor's by the rig, then each placement's by rig and captures."""
    nuisances = placement_parameters(rig, [p.key for p in placements])
    told = {p.key: p for p in placements}
    return ParameterTable((*sensor_parameters(rig), *(_as_told(n, told) for n in nuisances)))


def _as_told(parameter: Parameter, told: dict[str, PlacementInfo]) -> Parameter:
    """A placement's parameter with what the captures state of it in the place of the rig's prior."""
    key, _, name = parameter.name.rpartition(".")
    info = told[key]
    if name == "error_mm" and np.isfinite(info.standoff_sd_mm):
        return replace(parameter, prior=Prior(value=0.0, sd=info.standoff_sd_mm))
    if name == "slope_x" and info.yaw_deg:
        slope = tan(radians(info.yaw_deg))
        # d tan(a) = (1 + tan^2 a) da: far from square the same tilt changes the slope more.
        return replace(parameter, prior=Prior(value=slope, sd=parameter.prior.sd * (1 + slope**2)))
    return parameter


def _rms(cells: Cells, residual_px: FloatArray) -> float:
    """Root mean square of measured - predicted over every single coordinate."""
    predicted = cells.position_px - residual_px
    single = [positions(m) - p for m, p in zip(cells.members, predicted, strict=True)]
    return float(np.sqrt(np.nanmean(np.concatenate(single) ** 2)))


def _check(rig: Rig, sightings: Sequence[Sighting]) -> None:
    if not sightings:
        raise BadInputError("no spot is left to fit: expected captures with a known standoff and a spot each")
    for s in sightings:
        if s.laser_id not in rig.laser_ids:
            raise BadInputError(
                f"{s.source}: laser_id: expected one of {', '.join(rig.laser_ids)} (rig {rig.rig}),"
                f" got {s.laser_id}"
            )
        depth_mm = s.standoff_mm * (1 + rig.bench.ruler_scale.value) + rig.bench.offset_mm.value
        if not depth_mm > 0:
            raise BadInputError(
                f"{s.source}: standoff_mm: expected a target before the pinhole, got {s.standoff_mm:g} mm,"
                f" which rig {rig.rig} puts at a depth of {depth_mm:g} mm; check bench.offset_mm"
            )
