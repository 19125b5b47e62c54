"""While captures are taken: how good ranges already are, and which standoff would help most next.

The fit is `fit`'s to first order in the placements' errors, which makes them noise that their spots share. It
needs no program of its own for every number of placements, and so no second of waiting at each.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.calibration.batch import as_grid
from workbench.calibration.design import Aim, Choice, candidates
from workbench.calibration.expected import Expectation
from workbench.calibration.observations import Cells, Sighting, group, positions, stated_sd
from workbench.calibration.parameters import ParameterTable, sensor_parameters
from workbench.calibration.scatter import scale_called_for
from workbench.model.rig import NoiseSpec, Rig

FloatArray = NDArray[np.float64]
FEWEST = 2
"""Placements before there is anything to say."""
RANGES = 18
STEPS = 30
LONGEST_STEP = 2.0
"""In prior sd."""
DONE = 1e-6
SCALE_ROUNDS = 3


@dataclass(frozen=True)
class Advice:
    """Relative standard deviations are of a single range, its spot's noise included; 1 sigma."""

    placements: int
    relative_range_sd: float
    """The largest of any laser over the span that is planned, by the captures so far."""
    next_standoff_mm: float
    then_relative_range_sd: float
    """With a placement there, its readings as many and as good as those so far."""


def advise(rig: Rig, sightings: Sequence[Sighting], planned_mm: Sequence[float]) -> Advice | None:
    """Fit what was seen so far, and look for the standoff that makes the worst range best.

    Args:
        rig: priors, noise and reach.
        sightings: of a flat target.
        planned_mm: standoffs of the whole procedure: ranges should be good from the nearest to the farthest.

    Returns:
        None: there is too little yet, or it cannot be fitted.
    """
    cells, _ = group(sightings, rig.laser_ids, rig.noise)
    if len(cells.placements) < FEWEST:
        return None
    if (fitted := _fit(rig, cells)) is None:
        return None
    noise = _noise(rig, sightings, cells.repeat_scale, fitted.noise_scale)
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
    )


@dataclass(frozen=True)
class _Fitted:
    sensor: FloatArray
    """(1, S)"""
    covariance: FloatArray
    """(1, F, F) in prior sd."""
    noise_scale: float
    """On the stated noise, of which this is the fit."""
    scale_called_for: float


def _fit(rig: Rig, cells: Cells) -> _Fitted | None:
    """As `fit`, the noise scaled to the residuals where they are too large; None: no optimum was found."""
    scale, fitted = 1.0, None
    for _ in range(SCALE_ROUNDS):
        fitted = _fit_at(rig, cells, scale)
        if fitted is None or not fitted.scale_called_for > scale:
            break
        scale = fitted.scale_called_for
    return fitted


def _fit_at(rig: Rig, cells: Cells, scale: float) -> _Fitted | None:
    """Maximum a posteriori by Gauss-Newton, with the noise `scale` times what was stated."""
    table = ParameterTable(sensor_parameters(rig))
    free, standoffs = table.free, np.array([p.standoff_mm for p in cells.placements])
    position, sd = as_grid(cells, len(rig.lasers))
    y = np.zeros(len(table.prior_mean))
    for _ in range(STEPS):
        sensor = (table.prior_mean + table.prior_sd * y)[None]
        found = Expectation(rig, sensor).fit_rows(standoffs, position, scale * sd)
        rows, residual = (part[0] for part in found)
        flat, left = rows[..., free].reshape(-1, len(free)), residual.ravel()
        if not (np.isfinite(flat).all() and np.isfinite(left).all()):
            return None
        information = flat.T @ flat
        covariance = np.linalg.inv(information + np.eye(len(free)))
        step = covariance @ (flat.T @ left - y[free])
        y[free] += step * min(1.0, LONGEST_STEP / max(float(np.abs(step).max(initial=0.0)), LONGEST_STEP))
        if np.abs(step).max(initial=0.0) < DONE:
            freedom = int(np.isfinite(position).sum()) - float(np.trace(information @ covariance))
            called_for = scale_called_for(float(left @ left) * scale**2, freedom)
            return _Fitted(sensor, np.asarray(covariance[None]), scale, float(called_for))
    return None


def _worst(aim: Aim, covariance: FloatArray) -> float:
    """To four digits: a session that is resumed must come to the same, word for word."""
    return float(f"{np.sqrt((aim.variance(covariance) + aim.spot_sd**2).max()):.4g}")


def _noise(rig: Rig, sightings: Sequence[Sighting], repeat_scale: float, scale: float) -> NoiseSpec:
    """As a calibration would state it."""
    seen = np.isfinite(positions(sightings))
    own = float(np.sqrt((stated_sd(sightings, rig.noise)[seen] ** 2).mean()))
    return NoiseSpec(spot_sd_px=own * repeat_scale * scale, speckle_sd_px=rig.noise.speckle_sd_px * scale)
