"""Advice during a calibration: range uncertainty so far, and the best next standoff.

The fit is that of `fit`. The gain of one more placement is computed to first order, for a square target with
the placement error of the rig file.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from workbench.calibration.data.observations import (
    MeanObservations,
    Observation,
    as_grid,
    group,
    positions,
    stated_sd,
    stated_speckle_sd,
)
from workbench.calibration.design.expectation import Expectation
from workbench.calibration.design.standoffs import Candidates, RangeGoals, candidate_standoffs
from workbench.calibration.estimation.fit import table_of
from workbench.calibration.estimation.noise_scale import significant_scale
from workbench.calibration.estimation.problem import LeastSquaresProblem
from workbench.calibration.estimation.refit import measured, refit
from workbench.model.arrays import FloatArray
from workbench.model.rig import NoiseSpec, Rig

FEWEST = 2
"""Least number of placements for advice."""
RANGES = 18
"""Number of ranges over the planned span."""
SHOWN_MM = np.geomspace(100.0, 5000.0, 40)
"""Ranges whose uncertainty is shown, planned or not."""
SCALE_ROUNDS = 10
SCALE_TOLERANCE = 1.001


@dataclass(frozen=True)
class Advice:
    """Range uncertainty and best next standoff; relative sd of a single range with spot noise, 1 sigma."""

    placements: int
    relative_range_sd: float
    """The largest of any laser over the planned span, by the captures so far."""
    next_standoff_mm: float
    then_relative_range_sd: float
    """The same with one more placement there, with as many captures and as much noise as those so far."""
    worst_residual_px: float
    """Largest residual of a mean position, by its ratio to its noise."""
    worst_residual_sd: float
    """The same in standard deviations of the scaled noise."""
    worst_laser_id: str
    worst_standoff_mm: float
    ranges_mm: tuple[float, ...]
    """Ranges within the image of some laser, of SHOWN_MM."""
    range_sd: tuple[float, ...]
    """Relative sd at each of them, the largest of any laser that sees it."""
    parameter_sd: dict[str, float]
    """Standard deviation of each free parameter of the sensor, relative to its prior's."""


def advise(rig: Rig, observations: Sequence[Observation], planned_mm: Sequence[float]) -> Advice | None:
    """Fit the observations so far, and find the standoff that minimises the worst range uncertainty.

    Args:
        rig: priors, noise and reach.
        observations: of a flat target.
        planned_mm: standoffs of the whole procedure; ranges between the nearest and the farthest count.

    Returns:
        None with fewer than FEWEST placements, or where the fit has no finite result.
    """
    cells, _ = group(observations, rig.laser_ids, rig.noise)
    if len(cells.placements) < FEWEST:
        return None
    if (fitted := _fit(rig, cells, len(planned_mm))) is None:
        return None
    noise = _noise(rig, observations, cells.repeat_scale, fitted.noise_scale)
    now = Expectation(rig.model_copy(update={"noise": noise}), fitted.sensor)
    goals = RangeGoals.of(now, np.geomspace(min(planned_mm), max(planned_mm), RANGES), noise)
    repeats = max(1, round(float(np.mean([len(members) for members in cells.members]))))
    candidates = Candidates.of(now, candidate_standoffs(rig), repeats, goals)
    best = int(candidates.worst_with_one_more(fitted.covariance).argmin())
    rows = candidates.rows[:, best]
    then = np.asarray(np.linalg.inv(np.linalg.inv(fitted.covariance) + np.swapaxes(rows, 1, 2) @ rows), float)
    return Advice(
        placements=len(cells.placements),
        relative_range_sd=_worst(goals, fitted.covariance),
        next_standoff_mm=float(candidates.standoff_mm[best]),
        then_relative_range_sd=_worst(goals, then),
        **_worst_residual(rig, fitted),
        **_uncertainty(now, noise, fitted.covariance),
    )


@dataclass(frozen=True)
class _Fitted:
    """Fit of the observations so far, with M cells."""

    sensor: FloatArray
    """(1, S) values of the sensor's parameters."""
    covariance: FloatArray
    """(1, F, F) in prior sd."""
    noise_scale: float
    """Factor on the stated noise."""
    residual_sd: FloatArray
    """(M, 2) in standard deviations of the scaled noise, 0 where not measured."""
    residual_px: FloatArray
    """(M, 2)"""
    cells: MeanObservations


def _fit(rig: Rig, cells: MeanObservations, planned: int) -> _Fitted | None:
    """`fit` with the noise scaled to the residuals where they are too large; None: no finite result."""
    whole = padded(cells, len(rig.lasers), planned)
    table = table_of(rig, whole.placements)
    problem = LeastSquaresProblem.of(rig, table, whole, ())
    with np.errstate(over="ignore", invalid="ignore"):
        found = refit(problem, measured(problem), np.zeros(len(table.prior_mean)))
        for _ in range(SCALE_ROUNDS):
            scale = float(significant_scale(found.chi2 * found.scale**2, found.freedom))
            if not scale > found.scale * SCALE_TOLERANCE:
                break
            found = found.at(scale)
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


def _uncertainty(now: Expectation, noise: NoiseSpec, covariance: FloatArray) -> dict[str, Any]:
    """Uncertainty of ranges and parameters as fields of `Advice`, rounded to three digits as in `_worst`."""
    goals = RangeGoals.of(now, SHOWN_MM, noise)
    sd = np.sqrt(goals.total(goals.variance(covariance))).reshape(len(SHOWN_MM), -1).max(axis=1)
    seen = sd > 0
    names = [p.name for p in now.table.parameters]
    relative = np.sqrt(np.diag(covariance[0])).tolist()
    return {
        "ranges_mm": tuple(float(f"{mm:.4g}") for mm in SHOWN_MM[seen]),
        "range_sd": tuple(float(f"{one:.3g}") for one in sd[seen]),
        "parameter_sd": {
            names[i]: float(f"{one:.3g}") for i, one in zip(now.table.free.tolist(), relative, strict=True)
        },
    }


def _worst_residual(rig: Rig, fitted: _Fitted) -> dict[str, Any]:
    """The largest residual as fields of `Advice`, rounded to three digits as in `_worst`."""
    cell, axis = np.unravel_index(int(np.abs(fitted.residual_sd).argmax()), fitted.residual_sd.shape)
    placement = fitted.cells.placements[fitted.cells.placement[cell]]
    return {
        "worst_residual_px": float(f"{abs(fitted.residual_px[cell, axis]):.3g}"),
        "worst_residual_sd": float(f"{abs(fitted.residual_sd[cell, axis]):.3g}"),
        "worst_laser_id": rig.laser_ids[fitted.cells.laser[cell]],
        "worst_standoff_mm": placement.standoff_mm,
    }


def padded(cells: MeanObservations, lasers: int, planned: int) -> MeanObservations:
    """The mean observations, padded with unmeasured cells for all planned placements and all lasers.

    The fit after each placement then has the array shapes of the fit at the end: one compiled program.
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
        speckle_sd_px=np.full((len(laser), 2), np.nan),
        time=np.zeros(len(laser)),
        parts=np.ones((len(laser), 1)),
        members=(),
    )


def _worst(goals: RangeGoals, covariance: FloatArray) -> float:
    """Largest relative range sd, rounded to four digits: a resumed session must reproduce it exactly."""
    return float(f"{np.sqrt((goals.variance(covariance) + goals.spot_sd**2).max()):.4g}")


def _noise(rig: Rig, observations: Sequence[Observation], repeat_scale: float, scale: float) -> NoiseSpec:
    """Noise as a calibration of these observations states it."""
    seen = np.isfinite(positions(observations))
    own = float(np.sqrt((stated_sd(observations, rig.noise)[seen] ** 2).mean()))
    shared = float(np.sqrt((stated_speckle_sd(observations, rig.noise)[seen] ** 2).mean()))
    return NoiseSpec(spot_sd_px=own * repeat_scale * scale, speckle_sd_px=shared * scale)
