"""Many calibrations of one layout at once: simulation, bootstrap, design of standoffs.

The posterior is that of `fit`, the solver another: Gauss-Newton on the normal equations, damped as Levenberg
did where a step would climb. A placement's error and tilts meet only its own spots, so that their blocks are
eliminated from the normal equations first (Schur complement; F. Zhang, "The Schur Complement and Its
Applications", 2005) and what is left to solve has the size of the sensor alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from workbench.calibration.data.observations import MeanObservations, PlacementInfo
from workbench.calibration.estimation.fit import table_of
from workbench.calibration.estimation.noise_scale import scale_called_for
from workbench.calibration.model.layout import Layout
from workbench.calibration.model.parameters import PLACEMENT, ParameterTable
from workbench.calibration.model.prediction import predict_cell
from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.rig import Rig
from workbench.optics.rays import RAY

CHUNK = 16
"""Fits solved in step: enough to fill the vector units, few enough not to wait long for the slowest one."""
MAX_STEPS = 60
STEP_TOLERANCE_SD = 1e-7
"""Of the last step, in posterior standard deviations; each is smaller than the one before by 0.3 or less."""
NEAR_SD = 10.0
"""After a step shorter than this the normal equations hardly change any more."""
SCALE_TOLERANCE = 1.001
SCALE_ROUNDS = 10
FIRST_DAMPING = 1e-3
LEAST_DAMPING = 1e-9


@dataclass(frozen=True)
class BatchFit:
    """B calibrations. P parameters (S of the sensor, then 3 of each of J placements), 1 sigma throughout."""

    table: ParameterTable
    values: FloatArray
    """(B, P) maximum a posteriori."""
    sensor_covariance: FloatArray
    """(B, S, S) posterior."""
    placement_covariance: FloatArray
    """(B, J, 3, 3) posterior of each placement's error and slopes."""
    noise_scale: FloatArray
    """(B,) as in `Fit`."""
    chi2: FloatArray
    """(B,) of the data at the stated noise."""
    degrees_of_freedom: FloatArray
    """(B,)"""
    converged: BoolArray
    """(B,)"""

    @property
    def sensor(self) -> FloatArray:
        """(B, S) the sensor's values."""
        return np.asarray(self.values[:, : self.sensor_covariance.shape[1]])

    @property
    def sd(self) -> FloatArray:
        """(B, P) posterior standard deviations."""
        sensor = np.diagonal(self.sensor_covariance, axis1=1, axis2=2)
        placement = np.diagonal(self.placement_covariance, axis1=2, axis2=3)
        variance = np.concatenate([sensor, placement.reshape(len(sensor), -1)], axis=1)
        return np.asarray(np.sqrt(variance))


def fit_batch(
    rig: Rig,
    placements: Sequence[PlacementInfo],
    position_px: FloatArray,
    sd_px: FloatArray,
) -> BatchFit:
    """Fit B calibrations of one rig at the same J placements.

    Args:
        rig: priors; its L lasers in the order of the file.
        placements: J of them, shared by all calibrations.
        position_px: (B, J, L, 2) mean positions, NaN where not measured.
        sd_px: 1 sigma of the means, speckle included; broadcasts to `position_px`.
    """
    table = table_of(rig, placements)
    measured = np.isfinite(position_px)
    position = np.where(measured, position_px, 0.0)
    inverse_sd = np.where(measured, 1.0 / np.where(measured, sd_px, 1.0), 0.0)
    layout = Layout(rig.camera.lens, len(rig.lasers), len(placements))
    varied = tuple(np.flatnonzero(table.prior_sd[layout.common]).tolist())
    standoff_mm = np.array([p.standoff_mm for p in placements])
    shared = (layout, varied, table.prior_mean, table.prior_sd, standoff_mm)
    scale = np.ones(len(position))
    solved = _in_chunks(shared, np.zeros((len(position), len(table.prior_mean))), position, inverse_sd)
    for _ in range(SCALE_ROUNDS):
        called_for = scale_called_for(solved.chi2 * scale**2, solved.freedom)
        again = np.flatnonzero(called_for > scale * SCALE_TOLERANCE)
        if not len(again):
            break
        scale[again] = called_for[again]
        scaled = inverse_sd[again] / scale[again, None, None, None]
        better = _in_chunks(shared, solved.y[again], position[again], scaled)
        for whole, part in zip(solved, better, strict=True):
            whole[again] = part
    sd, of_sensor = table.prior_sd, table.prior_sd[layout.sensor]
    by_placement = sd[layout.errors].reshape(-1, len(PLACEMENT))
    return BatchFit(
        table=table,
        values=table.prior_mean + sd * solved.y,
        sensor_covariance=solved.sensor_covariance * np.outer(of_sensor, of_sensor),
        placement_covariance=solved.placement_covariance * by_placement[:, :, None] * by_placement[:, None],
        noise_scale=scale,
        chi2=solved.chi2 * scale**2,
        degrees_of_freedom=solved.freedom,
        converged=solved.converged,
    )


def as_grid(cells: MeanObservations, lasers: int) -> tuple[FloatArray, FloatArray]:
    """(J, L, 2) mean positions of one calibration and their standard deviations, NaN where not seen."""
    shape = (len(cells.placements), lasers, 2)
    position, sd = np.full(shape, np.nan), np.full(shape, np.nan)
    position[cells.placement, cells.laser] = cells.position_px
    sd[cells.placement, cells.laser] = cells.sd_px
    return position, sd


class _Solved(NamedTuple):
    """Of each fit, in units of the priors."""

    y: FloatArray
    sensor_covariance: FloatArray
    placement_covariance: FloatArray
    chi2: FloatArray
    freedom: FloatArray
    converged: BoolArray


def _in_chunks(
    shared: tuple[Any, ...], start: FloatArray, position: FloatArray, inverse_sd: FloatArray
) -> _Solved:
    """Solve CHUNK fits after CHUNK fits; the last ones are filled up with the first of theirs."""
    parts = []
    for first in range(0, len(position), CHUNK):
        chosen = np.arange(first, first + CHUNK)
        chosen = np.where(chosen < len(position), chosen, first)
        solved = _solve_chunk(*shared, start[chosen], position[chosen], inverse_sd[chosen])
        parts.append([np.asarray(part)[: len(position) - first] for part in solved])
    return _Solved(*(np.concatenate(part) for part in zip(*parts, strict=True)))


class _Shared(NamedTuple):
    """What the fits of a batch share. P and S count what is solved for: no constants of lens and bench."""

    cell: Layout
    """Of the inputs of a cell."""
    varied: tuple[int, ...]
    """Which parameters of lens and reference are no constants: the compiler leaves the others out."""
    common: Array
    """Values of lens and reference; those of the constants count."""
    mean: Array
    """(P,)"""
    sd: Array
    """(P,)"""
    standoff_mm: Array
    """(J,)"""

    def inputs(self, y: Array) -> list[Array]:
        """The inputs of every cell: scalars for all, (L,) by the laser, (J, 1) by the placement."""
        values = self.mean + self.sd * y
        common = list(self.common)
        for place, index in enumerate(self.varied):
            common[index] = values[place]
        return [*common, *self.by_cell(values)[len(self.varied) :]]

    def by_cell(self, values: Array) -> list[Array]:
        """(P,) as the inputs that are varied."""
        shared, sensor = len(self.varied), values.size - len(PLACEMENT) * len(self.standoff_mm)
        rays = values[shared:sensor].reshape(-1, len(RAY))
        errors = values[sensor:].reshape(-1, len(PLACEMENT))
        return [*values[:shared], *rays.T, *(errors[:, i : i + 1] for i in range(len(PLACEMENT)))]

    def predict(self, inputs: list[Array]) -> tuple[Array, Array]:
        """Pixel positions (u, v) of every cell, (J, L)."""
        return predict_cell(self.cell.lens_name, tuple(inputs), self.standoff_mm[:, None])


class _State(NamedTuple):
    y: Array
    """(P,)"""
    cost: Array
    """Sum of squares, the prior's included."""
    damping: Array
    step_sd: Array
    steps: Array


class _Normal(NamedTuple):
    """The normal equations with the placements eliminated, in the units of the priors."""

    schur: Array
    """(S, S) information on the sensor, every placement's error and tilts unknown."""
    coupling: Array
    """(J, 3, S) H_p^-1 H_ps: how the placements follow the sensor."""
    placement_inverse: Array
    """(J, 3, 3) H_p^-1."""
    gradient: Array
    """(P,)"""


@partial(jax.jit, static_argnums=(0, 1))
def _solve_chunk(
    layout: Layout,
    varied: tuple[int, ...],
    mean: Array,
    sd: Array,
    standoff_mm: Array,
    start: Array,
    position: Array,
    inverse_sd: Array,
) -> tuple[Array, ...]:
    kept = np.array([*varied, *range(layout.common.stop, mean.size)])
    shared = _Shared(Layout(layout.lens_name), varied, mean[layout.common], mean[kept], sd[kept], standoff_mm)

    def one(start: Array, position: Array, inverse_sd: Array) -> tuple[Array, ...]:
        y, sensor, *others = _solve_one(shared, start[kept], position, inverse_sd)
        whole = layout.sensor.stop
        among = np.ix_(kept[: len(sensor)], kept[: len(sensor)])
        return start.at[kept].set(y), jnp.eye(whole).at[among].set(sensor), *others

    return jax.vmap(one)(start, position, inverse_sd)


def _solve_one(shared: _Shared, start: Array, position: Array, inverse_sd: Array) -> tuple[Array, ...]:
    data = (shared, position, inverse_sd)
    state = _State(start, _cost(start, *data), jnp.zeros(()), jnp.full((), jnp.inf), jnp.zeros((), int))
    state = _descend(state, NEAR_SD, *data)
    state = _close_in(state, *data)
    # Nothing is left to do here but for a fit so bent that the last steps did not close in.
    state = _descend(state, STEP_TOLERANCE_SD, *data)

    normal = _normal(state.y, *data, jnp.zeros(()))
    factor = jnp.linalg.cholesky(normal.schur)
    sensor = jax.scipy.linalg.cho_solve((factor, True), jnp.eye(len(factor)))
    placement = normal.placement_inverse + jnp.einsum(
        "jas,st,jbt->jab", normal.coupling, sensor, normal.coupling
    )
    effective = state.y.size - jnp.trace(sensor) - jnp.trace(placement, axis1=1, axis2=2).sum()
    freedom = (inverse_sd > 0).sum() - effective
    chi2 = state.cost - state.y @ state.y
    return state.y, sensor, placement, chi2, freedom, state.step_sd <= STEP_TOLERANCE_SD


def _descend(
    state: _State, tolerance_sd: float, shared: _Shared, position: Array, inverse_sd: Array
) -> _State:
    """Steps until one is shorter than the tolerance."""

    def unfinished(state: _State) -> Array:
        return (state.step_sd > tolerance_sd) & (state.steps < MAX_STEPS)

    return jax.lax.while_loop(unfinished, lambda s: _step(s, shared, position, inverse_sd), state)


def _close_in(state: _State, shared: _Shared, position: Array, inverse_sd: Array) -> _State:
    """Near the optimum: steps with the normal equations kept and the gradient alone renewed.

    Gauss-Newton converges linearly there anyway, and a gradient is far cheaper than the equations.
    """
    data = (shared, position, inverse_sd)
    normal = _normal(state.y, *data, jnp.zeros(()))
    factor = jnp.linalg.cholesky(normal.schur)

    def unfinished(loop: tuple[Array, Array, Array, Array]) -> Array:
        _, step_sd, before, steps = loop
        return (step_sd > STEP_TOLERANCE_SD) & (step_sd < before) & (steps < MAX_STEPS)

    def closer(loop: tuple[Array, Array, Array, Array]) -> tuple[Array, Array, Array, Array]:
        y, step_sd, _, steps = loop
        gradient = 0.5 * jax.grad(_cost)(y, *data)
        step = _newton_step(normal, factor, gradient)
        return y + step, jnp.sqrt(jnp.abs(step @ gradient)), step_sd, steps + 1

    begin = (state.y, jnp.full((), NEAR_SD), jnp.full((), 2.0 * NEAR_SD), jnp.zeros((), int))
    y, step_sd, _, _ = jax.lax.while_loop(unfinished, closer, begin)
    closed = step_sd <= STEP_TOLERANCE_SD
    return state._replace(
        y=jnp.where(closed, y, state.y),
        cost=jnp.where(closed, _cost(y, *data), state.cost),
        step_sd=jnp.where(closed, step_sd, jnp.inf),
    )


def _step(state: _State, shared: _Shared, position: Array, inverse_sd: Array) -> _State:
    """One step, taken if it descends; else the damping grows."""
    normal = _normal(state.y, shared, position, inverse_sd, state.damping)
    factor = jnp.linalg.cholesky(normal.schur)
    step = _newton_step(normal, factor, normal.gradient)
    trial = state.y + step
    cost = _cost(trial, shared, position, inverse_sd)
    # At the optimum costs differ by rounding alone: a step of no size may not be refused for that.
    descends = cost <= state.cost * (1.0 + 1e-12)
    return _State(
        y=jnp.where(descends, trial, state.y),
        cost=jnp.where(descends, cost, state.cost),
        damping=jnp.where(descends, _relaxed(state.damping), jnp.maximum(10 * state.damping, FIRST_DAMPING)),
        # The Gauss-Newton decrement: no parameter moves by more than this many posterior sd.
        step_sd=jnp.where(descends, jnp.sqrt(jnp.abs(step @ normal.gradient)), jnp.inf),
        steps=state.steps + 1,
    )


def _newton_step(normal: _Normal, factor: Array, gradient: Array) -> Array:
    """(P,) minus the inverse of the information times a gradient, by `factor` L of schur = L L^T."""
    size = len(factor)
    by_placement = gradient[size:].reshape(-1, len(PLACEMENT))
    right = (normal.coupling * by_placement[..., None]).sum(axis=(0, 1)) - gradient[:size]
    sensor = jax.scipy.linalg.cho_solve((factor, True), right)
    own = (normal.placement_inverse * by_placement[:, None]).sum(axis=-1)
    placement = -own - (normal.coupling * sensor).sum(axis=-1)
    return jnp.concatenate([sensor, placement.ravel()])


def _relaxed(damping: Array) -> Array:
    return jnp.where(damping > LEAST_DAMPING, damping / 30.0, 0.0)


def _cost(y: Array, shared: _Shared, position: Array, inverse_sd: Array) -> Array:
    u, v = shared.predict(shared.inputs(y))
    residual = (jnp.stack([u, v], axis=-1) - position) * inverse_sd
    return (residual**2).sum() + y @ y


def _linearise(y: Array, shared: _Shared, position: Array, inverse_sd: Array) -> tuple[Array, Array]:
    """Residuals (J, L, 2) and their derivatives (varied inputs, J, L, 2), in sd and units of the priors."""
    inputs = shared.inputs(y)
    varied = [*shared.varied, *range(shared.cell.common.stop, len(inputs))]

    def by(index: int, scale: Array) -> Array:
        """Derivative by one input: all others have none, and the compiler need not work on zeros."""

        def moved(value: Array) -> tuple[Array, Array]:
            return shared.predict([*inputs[:index], value, *inputs[index + 1 :]])

        _, tangent = jax.jvp(moved, (inputs[index],), (scale,))
        return jnp.stack([jnp.broadcast_to(part, inverse_sd.shape[:2]) for part in tangent], axis=-1)

    slopes = [by(i, s) * inverse_sd for i, s in zip(varied, shared.by_cell(shared.sd), strict=True)]
    u, v = shared.predict(inputs)
    residual = (jnp.stack([u, v], axis=-1) - position) * inverse_sd
    return residual, jnp.stack(slopes)


def _normal(y: Array, shared: _Shared, position: Array, inverse_sd: Array, damping: Array) -> _Normal:
    residual, slopes = _linearise(y, shared, position, inverse_sd)
    lasers = residual.shape[1]
    count = len(shared.varied)
    common, ray, error = jnp.split(slopes, (count, count + len(RAY)))
    own = ray * jnp.eye(lasers)[:, None, None, :, None]
    sensor = jnp.concatenate([common, own.reshape(-1, *residual.shape)])

    size = len(sensor)
    prior = 1.0 + damping
    rows = sensor.reshape(size, -1)
    # Sums of products, not matrix products: these are too small for a library call each.
    information = (error[:, None] * error).sum(axis=(3, 4)).transpose(2, 0, 1)
    inverse = _inverse3(information + prior * jnp.eye(len(PLACEMENT)))
    cross = (error[:, None] * sensor).sum(axis=(3, 4)).transpose(2, 0, 1)
    coupling = (inverse[..., None] * cross[:, None]).sum(axis=2)
    eliminated = cross.reshape(-1, size).T @ coupling.reshape(-1, size)
    by_placement = (error * residual).sum(axis=(2, 3)).T
    return _Normal(
        schur=rows @ rows.T - eliminated + prior * jnp.eye(size),
        coupling=coupling,
        placement_inverse=inverse,
        gradient=jnp.concatenate([rows @ residual.ravel(), by_placement.ravel()]) + y,
    )


def _inverse3(a: Array) -> Array:
    """Inverse of symmetric positive 3 x 3 matrices (..., 3, 3), by cofactors."""
    rows = [jnp.cross(a[..., (i + 1) % 3, :], a[..., (i + 2) % 3, :]) for i in range(3)]
    adjugate = jnp.stack(rows, axis=-1)
    return adjugate / (a[..., 0, :] * rows[0]).sum(axis=-1)[..., None, None]
