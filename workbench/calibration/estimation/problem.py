"""Least-squares problem of a fit: residuals of the data and of the priors, and its solution."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from workbench.calibration.data.boards import BoardView
from workbench.calibration.data.observations import MeanObservations
from workbench.calibration.estimation.jit_cache import jit_cached
from workbench.calibration.estimation.noise_scale import significant_scale
from workbench.calibration.model.layout import Layout
from workbench.calibration.model.parameters import ParameterTable, fits_drift
from workbench.calibration.model.prediction import (
    CornerData,
    SpotData,
    predict_corners,
    predict_spots,
)
from workbench.model.arrays import FloatArray
from workbench.model.known_board import AnyBoard
from workbench.model.rig import Rig


@dataclass(frozen=True)
class Solution:
    """Solution of a problem with P parameters and M measured positions (spots first, then corners)."""

    y: FloatArray
    """(P,) (value - prior mean) / prior sd."""
    jacobian: FloatArray
    """(2 M, P) derivatives by `y` of the data's residuals, in standard deviations."""
    covariance: FloatArray
    """(P, P) of `y`."""
    residual_px: FloatArray
    """(M, 2) measured - predicted, NaN where not measured."""
    chi2: float
    """Of the data at the stated noise."""
    degrees_of_freedom: float
    significant_scale: float
    converged: bool


class _Data(NamedTuple):
    """Arrays of one fit, for JAX."""

    mean: ArrayLike
    sd: ArrayLike
    standoff_mm: ArrayLike
    spots: SpotData
    corners: CornerData
    position_px: ArrayLike
    """(M, 2)"""
    inverse_sd: ArrayLike
    """(M, 2), 0 where a coordinate was not measured."""


@dataclass(frozen=True)
class LeastSquaresProblem:
    """Least-squares problem of one fit, solved at any noise."""

    layout: Layout
    data: _Data

    @classmethod
    def of(
        cls,
        rig: Rig,
        table: ParameterTable,
        cells: MeanObservations,
        boards: Sequence[BoardView],
    ) -> LeastSquaresProblem:
        """Problem of mean observations and boards; every board's placement is among the placements."""
        position = np.concatenate([cells.position_px, *(b.corners.position_px for b in boards)])
        sd = np.concatenate([cells.sd_px, *(b.corners.sd_px for b in boards)])
        measured = np.isfinite(position)
        data = _Data(
            mean=table.prior_mean,
            sd=table.prior_sd,
            # A board held anywhere has its whole depth as its placement error.
            standoff_mm=np.nan_to_num([p.standoff_mm for p in cells.placements]),
            spots=SpotData(cells.laser, cells.placement, cells.time, cells.parts),
            corners=_corner_data(cells, boards, rig.board),
            position_px=np.where(measured, position, 0.0),
            inverse_sd=np.where(measured, 1.0 / sd, 0.0),
        )
        return cls(layout_of(rig, cells, boards), data)

    def linearise(self, y: FloatArray, scale: float = 1.0) -> tuple[FloatArray, FloatArray]:
        """Predicted - measured (2 M,) and its derivatives by y (2 M, P), in `scale` times the stated noise.

        The order is u, v of each position, spots first; 0 where not measured.
        """
        residual, jacobian, _ = _linearise(y, self.data, self.layout)
        return np.asarray(residual) / scale, np.asarray(jacobian) / scale

    def by_standoff(self, y: FloatArray, scale: float = 1.0) -> FloatArray:
        """(2 M,) derivatives of the residuals of `linearise` by the standoff of their placement, 1/mm."""
        return np.asarray(_linearise(y, self.data, self.layout)[2]) / scale

    def solve(self, scale: float) -> Solution:
        """Solve with `scale` times the stated pixel noise."""
        inverse_sd = np.asarray(self.data.inverse_sd)
        data = self.data._replace(inverse_sd=inverse_sd / scale)
        y, converged = _solve(data, self.layout)
        residual, jacobian, _ = (np.asarray(part) for part in _linearise(np.asarray(y), data, self.layout))
        information = jacobian.T @ jacobian
        covariance = np.linalg.inv(information + np.eye(len(information)))
        freedom = int((inverse_sd > 0).sum()) - float(np.trace(information @ covariance))
        chi2 = float(residual @ residual) * scale**2
        pixels = -residual.reshape(-1, 2) / np.where(inverse_sd > 0, inverse_sd / scale, np.nan)
        return Solution(
            y=np.asarray(y),
            jacobian=jacobian,
            covariance=covariance,
            residual_px=pixels,
            chi2=chi2,
            degrees_of_freedom=freedom,
            significant_scale=float(significant_scale(chi2, freedom)),
            converged=bool(converged),
        )


def layout_of(rig: Rig, cells: MeanObservations, boards: Sequence[BoardView]) -> Layout:
    """Layout of the parameters that `fit.table_of` makes."""
    parts = cells.parts.shape[1] if fits_drift(rig) else 1
    return Layout(rig.camera.lens, len(rig.lasers), len(cells.placements), len(boards), parts)


def _corner_data(cells: MeanObservations, boards: Sequence[BoardView], board: AnyBoard) -> CornerData:
    order = [p.key for p in cells.placements]
    counts = [len(b.corners.ids) for b in boards]
    ids = np.concatenate([np.array([], np.intp), *(b.corners.ids for b in boards)])
    seen = [_board_time(cells, order.index(b.placement.key)) for b in boards]
    return CornerData(
        board=np.repeat(np.arange(len(boards)), counts),
        placement=np.repeat(np.array([order.index(b.placement.key) for b in boards], np.intp), counts),
        printed_mm=board.corners_mm[ids],
        time=np.repeat(np.array([time for time, _ in seen], float), counts),
        parts=np.repeat(np.array([own for _, own in seen]).reshape(-1, cells.parts.shape[1]), counts, axis=0),
    )


def _board_time(cells: MeanObservations, placement: int) -> tuple[float, FloatArray]:
    """Mean time and shares of the parts of the spots beside a board; the session's middle without any."""
    beside = cells.placement == placement
    if not beside.any():
        return 0.0, np.full(cells.parts.shape[1], 1.0 / cells.parts.shape[1])
    return float(cells.time[beside].mean()), np.asarray(cells.parts[beside].mean(axis=0))


@jit_cached(static=1)
def _solve(data: _Data, layout: Layout) -> tuple[Array, Array]:
    """(P,) optimum in units of the priors, and whether the solver converged."""
    import optimistix as optx

    def residuals(y: Array, data: _Data) -> Array:
        return jnp.concatenate([_data_residual(y, data, layout), y])

    solver: optx.LevenbergMarquardt[Array, Array, None] = optx.LevenbergMarquardt(rtol=1e-10, atol=1e-10)
    start = jnp.zeros_like(jnp.asarray(data.mean))
    solution: optx.Solution[Array, None] = optx.least_squares(
        residuals, solver, start, data, max_steps=200, throw=False
    )
    return solution.value, jnp.asarray(solution.result == optx.RESULTS.successful)


@jit_cached(static=1)
def _linearise(y: Array, data: _Data, layout: Layout) -> tuple[Array, Array, Array]:
    """Residuals of the data in standard deviations (2 M,), and their derivatives.

    By y (2 M, P), and by the standoff of their placement (2 M,), 1/mm: a residual depends on one placement
    only, so that all standoffs are moved at once.
    """

    def residual(y: Array, farther_mm: Array) -> Array:
        standoff_mm = jnp.asarray(data.standoff_mm) + farther_mm
        return _data_residual(y, data._replace(standoff_mm=standoff_mm), layout)

    here = jnp.zeros(())
    return residual(y, here), *jax.jacfwd(residual, (0, 1))(y, here)


def _data_residual(y: Array, data: _Data, layout: Layout) -> Array:
    """(2 M,) predicted - measured positions in standard deviations; 0 where not measured."""
    values = jnp.asarray(data.mean) + jnp.asarray(data.sd) * y
    standoff_mm = jnp.asarray(data.standoff_mm)
    predicted = predict_spots(values, layout, data.spots, standoff_mm) if layout.lasers else jnp.zeros((0, 2))
    if layout.boards:
        corners = predict_corners(values, layout, data.corners, standoff_mm)
        predicted = jnp.concatenate([predicted, corners])
    return ((predicted - data.position_px) * data.inverse_sd).ravel()
