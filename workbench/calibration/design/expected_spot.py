"""Expected position of a spot by the rig file and by the observations so far."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from workbench.calibration.data.observations import MeanObservations, Observation, group
from workbench.calibration.design.expectation import Expectation
from workbench.calibration.estimation.gauss_newton import gauss_newton
from workbench.calibration.model.parameters import ParameterTable, sensor_parameters
from workbench.model.arrays import FloatArray
from workbench.model.rig import Rig

STEPS = 4
"""Gauss-Newton steps; the second already changes a spot by less than a pixel."""
SURE_SD = 2.0
"""Distance from the image's edge, in standard deviations, from which a spot counts as inside or outside."""


@dataclass(frozen=True)
class ExpectedSpot:
    """Expected position of one laser's spot; px, 1 sigma."""

    u_px: float
    v_px: float
    u_sd_px: float
    v_sd_px: float
    place: Literal["inside", "outside", "at the edge"]
    """Place with respect to the image."""


def expected_spot(
    rig: Rig, observations: Sequence[Observation], laser_id: str, standoff_mm: float
) -> ExpectedSpot:
    """Predict a laser's spot on a square flat target.

    The sensor alone is fitted; errors of the placements count as noise of the spots, which is accurate to
    some pixels. That noise depends on the derivatives of the spots, and is renewed in each step.

    Args:
        rig: priors, size of the image.
        observations: observations of flat targets so far; may be empty.
        laser_id: the laser.
        standoff_mm: of the target, by the ruler.
    """
    cells, _ = group(observations, rig.laser_ids, rig.noise)
    standoffs = np.array([*(p.standoff_mm for p in cells.placements), standoff_mm])
    table = ParameterTable(sensor_parameters(rig))

    def spots(y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        sensors = (table.prior_mean + y * table.prior_sd)[None]
        position, slopes, sd = (part[0] for part in Expectation(rig, sensors).spots(standoffs))
        return position, slopes, sd

    y = gauss_newton(lambda y: _residuals(cells, y, *spots(y)), np.zeros(len(table.prior_sd)), STEPS)
    spot, slopes, sd = spots(y)
    rows = _residuals(cells, y, spot, slopes, sd)[1]
    covariance = np.linalg.inv(rows.T @ rows)
    asked = len(standoffs) - 1, rig.laser_ids.index(laser_id)
    sd_px = np.sqrt(((slopes[asked] @ covariance) * slopes[asked]).sum(axis=-1) + sd[asked] ** 2)
    return _placed(rig, spot[asked], sd_px)


def lasers_outside(rig: Rig, standoffs_mm: Sequence[float]) -> dict[float, tuple[str, ...]]:
    """Lasers whose most probable spot is outside the image at each standoff, by the rig file alone.

    Args:
        rig: priors, size of the image.
        standoffs_mm: of a square flat target, by the ruler.
    """
    prior_mean = ParameterTable(sensor_parameters(rig)).prior_mean
    (seen,) = Expectation(rig, prior_mean[None]).in_frame(np.array(standoffs_mm))
    return {
        standoff_mm: tuple(laser_id for laser_id, inside in zip(rig.laser_ids, at, strict=True) if not inside)
        for standoff_mm, at in zip(standoffs_mm, seen.tolist(), strict=True)
    }


def _residuals(
    cells: MeanObservations, y: FloatArray, spot: FloatArray, slopes: FloatArray, sd: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Residuals of the measured coordinates and of the priors, in standard deviations, and derivatives by y.

    Args:
        cells: the mean observations.
        y: (S,) parameters in prior sd.
        spot: (J, L, 2) predicted positions; `slopes` and `sd` as returned by `Expectation.spots`.
        slopes: (J, L, 2, S)
        sd: (J, L, 2)
    """
    at, measured = (cells.placement, cells.laser), np.isfinite(cells.position_px)
    noise = np.hypot(sd[at], cells.sd_px)
    residual = ((spot[at] - cells.position_px) / noise)[measured]
    rows = (slopes[at] / noise[..., None])[measured]
    return np.concatenate([residual, y]), np.vstack([rows, np.eye(len(y))])


def _placed(rig: Rig, spot: FloatArray, sd: FloatArray) -> ExpectedSpot:
    size = np.array([rig.camera.width_px, rig.camera.height_px])
    inwards = np.minimum(spot + 0.5, size - 0.5 - spot) / sd
    least = float(inwards.min())
    place: Literal["inside", "outside", "at the edge"] = (
        "outside" if least < -SURE_SD else "inside" if least > SURE_SD else "at the edge"
    )
    return ExpectedSpot(float(spot[0]), float(spot[1]), float(sd[0]), float(sd[1]), place)
