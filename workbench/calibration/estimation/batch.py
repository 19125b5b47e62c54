"""Batch solver: many calibrations of one layout at once, for simulation, bootstrap and design of standoffs.

The posterior is that of `fit`, without a drift and with placement errors as stated. The solver is Gauss-
Newton on the normal equations, with Levenberg's damping where a step would increase the cost. With y =
(sensor s, placements p) the equations are

    [H_ss  H_sp] [ds]     [g_s]
    [H_ps  H_pp] [dp] = - [g_p]

H_pp is block diagonal with 3 x 3 blocks, because error and tilts of a placement affect its own spots only.
First the Schur complement `(H_ss - H_sp H_pp^-1 H_ps) ds = H_sp H_pp^-1 g_p - g_s` is solved for ds; it has
the size of the sensor alone. Then `dp = -H_pp^-1 (g_p + H_ps ds)` (F. Zhang, "The Schur Complement and Its
Applications", 2005). The first steps renew the equations. Near the optimum only the gradient is renewed: a
quasi-Newton iteration with linear convergence and much cheaper steps (`_close_in`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from workbench.calibration.data.observations import PlacementInfo
from workbench.calibration.estimation.fit import table_of
from workbench.calibration.estimation.jit_cache import jit_cached
from workbench.calibration.estimation.noise_scale import significant_scale
from workbench.calibration.model.layout import Layout
from workbench.calibration.model.parameters import PLACEMENT, ParameterTable
from workbench.calibration.model.prediction import predict_cell
from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.rig import Rig
from workbench.optics.rays import RAY

CHUNK = 16
"""Fits solved together: enough to fill the vector units, few enough that none waits long for the slowest."""
MAX_STEPS = 60
STEP_TOLERANCE_SD = 1e-7
"""Length of the last step in posterior standard deviations; each step is at most 0.3 of the one before."""
NEAR_SD = 10.0
"""Length of a step, in posterior sd, below which the normal equations hardly change any more."""
SCALE_TOLERANCE = 1.001
"""The noise scale has converged where the residuals ask for less than this factor more."""
SCALE_ROUNDS = 10
FIRST_DAMPING = 1e-3
LEAST_DAMPING = 1e-9
"""Damping below this becomes 0."""


@dataclass(frozen=True)
class BatchFit:
    """B calibrations: P parameters (S of the sensor, then 3 of each of J placements); sd are 1 sigma."""

    table: ParameterTable
    values: FloatArray
    """(B, P) maximum a posteriori."""
    sensor_covariance: FloatArray
    """(B, S, S) posterior."""
    placement_covariance: FloatArray
    """(B, J, 3, 3) posterior of each placement's error and slopes."""
    noise_scale: FloatArray
    """(B,) as in `CalibrationFit`."""
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
        rig: priors, and L lasers in the order of the file.
        placements: J placements, shared by all calibrations.
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
    prior = (table.prior_mean, table.prior_sd)

    def solve(*chunk: FloatArray) -> tuple[Array, ...]:
        return _solve_chunk(*prior, standoff_mm, *chunk, layout, varied)

    scale = np.ones(len(position))
    solved = _in_chunks(solve, np.zeros((len(position), len(table.prior_mean))), position, inverse_sd)
    for _ in range(SCALE_ROUNDS):
        called_for = significant_scale(solved.chi2 * scale**2, solved.freedom)
        again = np.flatnonzero(called_for > scale * SCALE_TOLERANCE)
        if not len(again):
            break
        scale[again] = called_for[again]
        scaled = inverse_sd[again] / scale[again, None, None, None]
        better = _in_chunks(solve, solved.y[again], position[again], scaled)
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


class _Solved(NamedTuple):
    """Solutions of B fits in units of the priors; shapes as in `BatchFit`."""

    y: FloatArray
    sensor_covariance: FloatArray
    placement_covariance: FloatArray
    chi2: FloatArray
    freedom: FloatArray
    converged: BoolArray


def _in_chunks(solve: Callable[..., tuple[Array, ...]], *fits: FloatArray) -> _Solved:
    """Solve the fits in chunks of CHUNK; the last chunk is filled with copies of its first fit."""
    parts, count = [], len(fits[0])
    for first in range(0, count, CHUNK):
        chosen = np.arange(first, first + CHUNK)
        chosen = np.where(chosen < count, chosen, first)
        solved = solve(*(part[chosen] for part in fits))
        parts.append([np.asarray(part)[: count - first] for part in solved])
    return _Solved(*(np.concatenate(part) for part in zip(*parts, strict=True)))


class _Shared(NamedTuple):
    """Data that the fits of a batch share. P and S count free parameters only, no constants."""

    cell: Layout
    """Layout of the inputs of a cell."""
    varied: tuple[int, ...]
    """Indices of the free parameters of lens and reference; the compiler omits the constants."""
    common: Array
    """Values of lens and reference; only those of the constants are used."""
    mean: Array
    """(P,)"""
    sd: Array
    """(P,)"""
    standoff_mm: Array
    """(J,)"""

    def inputs(self, y: Array) -> list[Array]:
        """Inputs of all cells: scalars for lens and reference, (L,) by laser, (J, 1) by placement."""
        values = self.mean + self.sd * y
        common = list(self.common)
        for place, index in enumerate(self.varied):
            common[index] = values[place]
        return [*common, *self.by_cell(values)[len(self.varied) :]]

    def by_cell(self, values: Array) -> list[Array]:
        """(P,) values as the free inputs of all cells."""
        shared, sensor = len(self.varied), values.size - len(PLACEMENT) * len(self.standoff_mm)
        rays = values[shared:sensor].reshape(-1, len(RAY))
        errors = values[sensor:].reshape(-1, len(PLACEMENT))
        return [*values[:shared], *rays.T, *(errors[:, i : i + 1] for i in range(len(PLACEMENT)))]

    def predict(self, inputs: list[Array]) -> tuple[Array, Array]:
        """Pixel positions (u, v) of all cells, (J, L)."""
        return predict_cell(self.cell.lens_name, tuple(inputs), self.standoff_mm[:, None])


class _State(NamedTuple):
    """State of the iteration."""

    y: Array
    """(P,)"""
    cost: Array
    """Sum of squared residuals of data and priors."""
    damping: Array
    step_sd: Array
    """Length of the last step in posterior standard deviations; infinite after a refused step."""
    steps: Array
    """Number of steps."""


class _Normal(NamedTuple):
    """The normal equations with the placements eliminated, in units of the priors."""

    schur: Array
    """(S, S) information on the sensor, marginalised over the placements."""
    coupling: Array
    """(J, 3, S) H_pp^-1 H_ps."""
    placement_inverse: Array
    """(J, 3, 3) H_pp^-1."""
    gradient: Array
    """(P,)"""


@jit_cached(static=2)
def _solve_chunk(
    mean: Array,
    sd: Array,
    standoff_mm: Array,
    start: Array,
    position: Array,
    inverse_sd: Array,
    layout: Layout,
    varied: tuple[int, ...],
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
    # Returns at once unless a strongly non-linear fit did not converge with fixed equations.
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
    """Damped Gauss-Newton steps until one is shorter than the tolerance."""

    def unfinished(state: _State) -> Array:
        return (state.step_sd > tolerance_sd) & (state.steps < MAX_STEPS)

    return jax.lax.while_loop(unfinished, lambda s: _step(s, shared, position, inverse_sd), state)


def _close_in(state: _State, shared: _Shared, position: Array, inverse_sd: Array) -> _State:
    """Steps near the optimum with fixed normal equations and a new gradient each.

    Gauss-Newton converges linearly near the optimum anyway, and a gradient is far cheaper than the equations.
    Where the steps do not shrink to the tolerance, the state before them is returned.
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
    """One step, taken if the cost decreases; otherwise the damping grows."""
    normal = _normal(state.y, shared, position, inverse_sd, state.damping)
    factor = jnp.linalg.cholesky(normal.schur)
    step = _newton_step(normal, factor, normal.gradient)
    trial = state.y + step
    cost = _cost(trial, shared, position, inverse_sd)
    # At the optimum costs differ by rounding: a step of negligible length must not be refused.
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
    """(P,) step -H^-1 g by the Schur complement, with `factor` L of schur = L L^T."""
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
    """Residuals (J, L, 2) in sd, and derivatives (free inputs, J, L, 2) in units of the priors."""
    inputs = shared.inputs(y)
    varied = [*shared.varied, *range(shared.cell.common.stop, len(inputs))]

    def by(index: int, scale: Array) -> Array:
        """Derivative by one input; with all others constant the compiler computes no zero tangents."""

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
    # Sums of products, not matrix products: the 3 x 3 blocks are too small for a library call each.
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
