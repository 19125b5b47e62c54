"""Expected position of a spot by the rig file and by the observations so far."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from workbench.calibration.data.observations import Observation, group
from workbench.calibration.design.expectation import Expectation
from workbench.calibration.model.parameters import ParameterTable, sensor_parameters
from workbench.model.arrays import FloatArray
from workbench.model.rig import Rig

ROUNDS = 5
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
    some pixels. The Gauss-Newton steps are written out, because the noise is renewed in each from the
    derivatives by the placement errors; a solver with a fixed cost function would converge to another point.

    Args:
        rig: priors, size of the image.
        observations: observations of flat targets so far; may be empty.
        laser_id: the laser.
        standoff_mm: of the target, by the ruler.
    """
    cells, _ = group(observations, rig.laser_ids, rig.noise)
    standoffs = np.array([*(p.standoff_mm for p in cells.placements), standoff_mm])
    table = ParameterTable(sensor_parameters(rig))
    y = np.zeros(len(table.prior_sd))
    for _ in range(ROUNDS):
        sensors = (table.prior_mean + y * table.prior_sd)[None]
        spot, slopes, sd = (part[0] for part in Expectation(rig, sensors).spots(standoffs))
        at = cells.placement, cells.laser
        noise = np.hypot(sd[at], cells.sd_px)
        seen = np.isfinite(cells.position_px)
        rows = (slopes[at] / noise[..., None])[seen]
        residual = ((cells.position_px - spot[at]) / noise)[seen]
        covariance = np.linalg.inv(np.eye(len(y)) + rows.T @ rows)
        y = covariance @ (rows.T @ (residual + rows @ y))
    asked = len(standoffs) - 1, rig.laser_ids.index(laser_id)
    sd_px = np.sqrt(((slopes[asked] @ covariance) * slopes[asked]).sum(axis=-1) + sd[asked] ** 2)
    return _placed(rig, spot[asked], sd_px)


def _placed(rig: Rig, spot: FloatArray, sd: FloatArray) -> ExpectedSpot:
    size = np.array([rig.camera.width_px, rig.camera.height_px])
    inwards = np.minimum(spot + 0.5, size - 0.5 - spot) / sd
    least = float(inwards.min())
    place: Literal["inside", "outside", "at the edge"] = (
        "outside" if least < -SURE_SD else "inside" if least > SURE_SD else "at the edge"
    )
    return ExpectedSpot(float(spot[0]), float(spot[1]), float(sd[0]), float(sd[1]), place)
