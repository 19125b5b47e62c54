"""While captures are taken: how good ranges already are, and which standoff would help most next.

The fit is that of `fit`. What a placement more would tell is worked out to first order, of a square target
placed as exactly as the rig file says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from workbench.calibration.data.observations import MeanObservations, Observation, group, positions, stated_sd
from workbench.calibration.design.expectation import Expectation
from workbench.calibration.design.standoffs import Aim, Choice, candidates
from workbench.calibration.estimation.batch import as_grid
from workbench.calibration.estimation.fit import table_of
from workbench.calibration.estimation.noise_scale import scale_called_for
from workbench.calibration.estimation.problem import LeastSquaresProblem
from workbench.calibration.estimation.refit import measured, refit
from workbench.model.arrays import FloatArray
from workbench.model.rig import NoiseSpec, Rig

FEWEST = 2
"""Placements before there is anything to say."""
RANGES = 18
SCALE_ROUNDS = 10


@dataclass(frozen=True)
class Advice:
    """Relative standard deviations are of a single range, its spot's noise included; 1 sigma."""

    placements: int
    relative_range_sd: float
    """The largest of any laser over the span that is planned, by the captures so far."""
    next_standoff_mm: float
    then_relative_range_sd: float
    """With a placement there, its readings as many and as good as those so far."""
    worst_residual_px: float
    """Of a mean position, in the coordinate in which it is the most deviations of its noise."""
    worst_residual_sd: float
    """The same in those, as far as the residuals called for scaled up."""
    worst_laser_id: str
    worst_standoff_mm: float


def advise(rig: Rig, observations: Sequence[Observation], planned_mm: Sequence[float]) -> Advice | None:
    """Fit what was seen so far, and look for the standoff that makes the worst range best.

    Args:
        rig: priors, noise and reach.
        observations: of a flat target.
        planned_mm: standoffs of the whole procedure: ranges should be good from the nearest to the farthest.

    Returns:
        None: there is too little yet, or it cannot be fitted.
    """
    cells, _ = group(observations, rig.laser_ids, rig.noise)
    if len(cells.placements) < FEWEST:
        return None
    if (fitted := _fit(rig, cells, len(planned_mm))) is None:
        return None
    noise = _noise(rig, observations, cells.repeat_scale, fitted.noise_scale)
    now = Expectation(rig.model_copy(update={"noise": noise}), fitted.sensor)
    aim = Aim.of(now, np.geomspace(min(planned_mm), max(planned_mm), RANGES), noise)
    repeats = max(1, round(float(np.mean([len(members) for members in cells.members]))))
    choice = Choice.of(now, candidates(rig), repeats, aim)
    best = int(choice.worst_with_one_more(fitted.covariance).argmin())
    told = choice.rows[:, best]
    then = np.asarray(np.linalg.inv(np.linalg.inv(fitted.covariance) + np.swapaxes(told, 1, 2) @ told), float)
    return Advice(
        placements=len(cells.placements),
        relative_range_sd=_worst(aim, fitted.covariance),
        next_standoff_mm=float(choice.standoff_mm[best]),
        then_relative_range_sd=_worst(aim, then),
        **_worst_residual(rig, fitted),
    )


@dataclass(frozen=True)
class _Fitted:
    sensor: FloatArray
    """(1, S)"""
    covariance: FloatArray
    """(1, F, F) in prior sd."""
    noise_scale: float
    """On the stated noise."""
    residual_sd: FloatArray
    """(M, 2) of each cell in deviations of the noise so scaled, 0 where nothing was measured."""
    residual_px: FloatArray
    """(M, 2)"""
    cells: MeanObservations


def _fit(rig: Rig, cells: MeanObservations, planned: int) -> _Fitted | None:
    """As `fit`, the noise scaled to the residuals where they are too large; None: no finite result."""
    whole = _with_room(cells, len(rig.lasers), planned)
    table = table_of(rig, whole.placements)
    problem = LeastSquaresProblem.of(rig, table, whole, ())
    with np.errstate(over="ignore", invalid="ignore"):
        found = refit(problem, measured(problem), np.zeros(len(table.prior_mean)))
        for _ in range(SCALE_ROUNDS):
            called_for = float(scale_called_for(found.chi2 * found.scale**2, found.freedom))
            if not called_for > found.scale * 1.001:
                break
            found = found.at(called_for)
    if not np.isfinite([*found.y, found.chi2]).all():
        return None
    sensor = int(table.is_sensor.sum())
    free = table.free[table.free < sensor]
    values = table.prior_mean + table.prior_sd * found.y
    residual_sd = np.where(np.isfinite(whole.position_px), found.residual.reshape(-1, 2), 0.0)
    return _Fitted(
        values[None, :sensor],
        found.covariance[np.ix_(free, free)][None],
        found.scale,
        residual_sd,
        residual_sd * found.scale * np.nan_to_num(whole.sd_px),
        whole,
    )


def _worst_residual(rig: Rig, fitted: _Fitted) -> dict[str, Any]:
    """To three digits, for the same reason as `_worst`."""
    cell, axis = np.unravel_index(int(np.abs(fitted.residual_sd).argmax()), fitted.residual_sd.shape)
    placement = fitted.cells.placements[fitted.cells.placement[cell]]
    return {
        "worst_residual_px": float(f"{abs(fitted.residual_px[cell, axis]):.3g}"),
        "worst_residual_sd": float(f"{abs(fitted.residual_sd[cell, axis]):.3g}"),
        "worst_laser_id": rig.laser_ids[fitted.cells.laser[cell]],
        "worst_standoff_mm": placement.standoff_mm,
    }


def _with_room(cells: MeanObservations, lasers: int, planned: int) -> MeanObservations:
    """The cells with a place for every spot of the procedure, those not seen without a measurement.

    So the fit after each placement is the same program, that of the fit at the end.
    """
    first = cells.placements[0]
    room = range(planned - len(cells.placements))
    placements = (*cells.placements, *(replace(first, key=f"ahead {n}") for n in room))
    position, sd = as_grid(replace(cells, placements=placements), lasers)
    placement, laser = np.indices(position.shape[:2]).reshape(2, -1)
    return MeanObservations(
        placements=placements,
        laser=laser,
        placement=placement,
        position_px=position.reshape(-1, 2),
        sd_px=sd.reshape(-1, 2),
        time=np.zeros(len(laser)),
        members=(),
    )


def _worst(aim: Aim, covariance: FloatArray) -> float:
    """To four digits: a session that is resumed must come to the same, word for word."""
    return float(f"{np.sqrt((aim.variance(covariance) + aim.spot_sd**2).max()):.4g}")


def _noise(rig: Rig, observations: Sequence[Observation], repeat_scale: float, scale: float) -> NoiseSpec:
    """As a calibration would state it."""
    seen = np.isfinite(positions(observations))
    own = float(np.sqrt((stated_sd(observations, rig.noise)[seen] ** 2).mean()))
    return NoiseSpec(spot_sd_px=own * repeat_scale * scale, speckle_sd_px=rig.noise.speckle_sd_px * scale)
