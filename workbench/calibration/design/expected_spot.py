"""Where a spot that was not seen should be: by the rig file, and by the spots that were seen so far."""

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
"""Of Gauss and Newton: the second already moves a spot by less than a pixel."""
SURE_SD = 2.0
"""A spot this far beyond the edge of the picture, or inside of it, is taken to be there."""


@dataclass(frozen=True)
class ExpectedSpot:
    """Of one laser's spot. Pixels; sd is 1 sigma."""

    u_px: float
    v_px: float
    u_sd_px: float
    v_sd_px: float
    place: Literal["inside", "outside", "at the edge"]
    """With respect to the picture."""


def expected_spot(
    rig: Rig, observations: Sequence[Observation], laser_id: str, standoff_mm: float
) -> ExpectedSpot:
    """Expect a laser's spot on a square flat target.

    A fit of the sensor alone: placements are exact in it but for noise, which suffices for some pixels.

    Args:
        rig: priors, size of the picture.
        observations: what was seen so far, of flat targets; may be none.
        laser_id: whose spot.
        standoff_mm: by the ruler.
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
        missed = ((cells.position_px - spot[at]) / noise)[seen]
        covariance = np.linalg.inv(np.eye(len(y)) + rows.T @ rows)
        y = covariance @ (rows.T @ (missed + rows @ y))
    asked = len(standoffs) - 1, rig.laser_ids.index(laser_id)
    spread = np.sqrt(((slopes[asked] @ covariance) * slopes[asked]).sum(axis=-1) + sd[asked] ** 2)
    return _placed(rig, spot[asked], spread)


def _placed(rig: Rig, spot: FloatArray, sd: FloatArray) -> ExpectedSpot:
    size = np.array([rig.camera.width_px, rig.camera.height_px])
    inwards = np.minimum(spot + 0.5, size - 0.5 - spot) / sd
    least = float(inwards.min())
    place: Literal["inside", "outside", "at the edge"] = (
        "outside" if least < -SURE_SD else "inside" if least > SURE_SD else "at the edge"
    )
    return ExpectedSpot(float(spot[0]), float(spot[1]), float(sd[0]), float(sd[1]), place)
