"""While captures are taken: how good ranges already are, and which standoff would help most next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan

import numpy as np

from workbench.calibration.batch import as_grid, fit_batch
from workbench.calibration.design import Aim, Choice, candidates
from workbench.calibration.expected import Expectation
from workbench.calibration.observations import PlacementInfo, Sighting, group, positions, stated_sd
from workbench.model.rig import NoiseSpec, Rig

FEWEST = 2
"""Placements before there is anything to say."""
RANGES = 18
SPARE_MM = 1000.0
"""Any standoff: of a placement that nothing was seen at yet."""


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
    cells, _ = group(sightings, rig.laser_ids, rig.noise) if sightings else (None, ())
    if cells is None or len(cells.placements) < FEWEST:
        return None
    position, sd = as_grid(cells, len(rig.lasers))
    # Always as many placements as there will be: another number would be another program to compile.
    spare = max(len(planned_mm) - len(cells.placements), 0)
    infos = [*cells.placements, *(PlacementInfo(f"to come {n}", SPARE_MM, nan, 0.0) for n in range(spare))]
    empty = np.full((spare, *position.shape[1:]), nan)
    fitted = fit_batch(rig, infos, np.concatenate([position, empty])[None], np.concatenate([sd, empty])[None])
    if not fitted.converged[0]:
        return None
    noise = _noise(rig, sightings, cells.repeat_scale, float(fitted.noise_scale[0]))
    now = Expectation(rig.model_copy(update={"noise": noise}), fitted.sensor)
    free, prior_sd = now.table.free, now.table.prior_sd
    covariance = fitted.sensor_covariance[:, free[:, None], free] / np.outer(prior_sd[free], prior_sd[free])
    aim = Aim.of(now, np.geomspace(min(planned_mm), max(planned_mm), RANGES), noise)
    repeats = max(1, round(np.mean([len(members) for members in cells.members])))
    choice = Choice.of(now, candidates(rig), repeats, aim)
    best = int(choice.worst_with_one_more(covariance).argmin())
    told = choice.rows[:, best]
    then = np.linalg.inv(np.linalg.inv(covariance) + np.swapaxes(told, 1, 2) @ told)
    return Advice(
        placements=len(cells.placements),
        relative_range_sd=_worst(aim, covariance),
        next_standoff_mm=float(choice.standoff_mm[best]),
        then_relative_range_sd=_worst(aim, then),
    )


def _worst(aim: Aim, covariance: np.ndarray) -> float:
    return float(np.sqrt((aim.variance(covariance) + aim.spot_sd**2).max()))


def _noise(rig: Rig, sightings: Sequence[Sighting], repeat_scale: float, noise_scale: float) -> NoiseSpec:
    """As a calibration would state it."""
    seen = np.isfinite(positions(sightings))
    own = float(np.sqrt((stated_sd(sightings, rig.noise)[seen] ** 2).mean()))
    return NoiseSpec(
        spot_sd_px=own * repeat_scale * noise_scale, speckle_sd_px=rig.noise.speckle_sd_px * noise_scale
    )
