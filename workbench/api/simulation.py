"""Many simulated sensors of one rig, each with its calibration."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from workbench.api.arguments import millimetres_of, rig_of, whole_of
from workbench.calibration.design.forecast import RANGES_MM
from workbench.calibration.design.simulation import SimulatedCalibrations, simulate_calibrations
from workbench.model.arrays import FloatArray
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig
from workbench.report.frames import SIMULATED_PARAMETER_COLUMNS, SIMULATED_RANGE_COLUMNS

STANDOFFS_MM = (125, 160, 210, 280, 400, 600, 900, 1400, 2200, 3200, 4500)
"""Standoffs of procedures/calibrate-flat.yaml."""


@dataclass(frozen=True)
class Simulation:
    """Result of `simulate`."""

    parameters: pd.DataFrame
    """One row per sensor and free parameter: true value, estimate, 1 sigma."""
    ranges: pd.DataFrame
    """One row per sensor, laser and range: error of one range, and its stated 1 sigma."""


def simulate(
    rig: str | Path | Rig,
    n: int = 1000,
    seed: int = 1,
    standoffs: float | Collection[float] = STANDOFFS_MM,
    repeats: int = 10,
    ranges_mm: float | Collection[float] = RANGES_MM,
) -> Simulation:
    """Draw sensors from the tolerances of a rig, calibrate each, and range with each.

    Examples:
        >>> import workbench as wb
        >>> simulation = wb.simulate("rigs/thesis-emulated.yaml", n=16, standoffs=[200, 600, 2000])
        >>> simulation.parameters["sensor"].nunique()
        16

    Args:
        rig: a rig file, or its contents.
        n: number of sensors.
        seed: of the random numbers; equal arguments give equal results.
        standoffs: mm.
        repeats: captures of each laser at each standoff.
        ranges_mm: true ranges of a square target, ranged once by each laser.

    Raises:
        BadInputError: an argument is wrong, or no sensor has a spot in the image at a standoff.
    """
    at, ranges = millimetres_of("standoffs", standoffs), millimetres_of("ranges_mm", ranges_mm)
    if not at or not ranges or min(*at, *ranges) <= 0:
        raise BadInputError("standoffs, ranges_mm: expected at least one each, and positive numbers in mm")
    rng = np.random.default_rng(whole_of("seed", seed, least=0))
    count, captures = whole_of("n", n), whole_of("repeats", repeats)
    found = simulate_calibrations(rig_of(rig), at, captures, count, rng)
    return Simulation(_parameters(found), _ranges(found, np.array(ranges), rng))


def _parameters(found: SimulatedCalibrations) -> pd.DataFrame:
    sensors, size = found.truth.shape
    free = found.fit.table.free[found.fit.table.free < size]
    names = [found.fit.table.parameters[i].name for i in free.tolist()]
    columns = (
        np.repeat(np.arange(sensors), len(free)),
        np.tile(names, sensors),
        found.truth[:, free].ravel(),
        found.fit.sensor[:, free].ravel(),
        found.fit.sd[:, free].ravel(),
    )
    return pd.DataFrame(dict(zip(SIMULATED_PARAMETER_COLUMNS, columns, strict=True)))


def _ranges(found: SimulatedCalibrations, range_mm: FloatArray, rng: np.random.Generator) -> pd.DataFrame:
    ranged, lasers = found.ranges(range_mm, rng), found.rig.laser_ids
    sensors, cells = len(found.truth), len(range_mm) * len(lasers)
    columns = (
        np.repeat(np.arange(sensors), cells),
        np.tile(lasers, sensors * len(range_mm)),
        np.tile(np.repeat(range_mm, len(lasers)), sensors),
        ranged.error_mm.ravel(),
        ranged.sd_mm.ravel(),
    )
    return pd.DataFrame(dict(zip(SIMULATED_RANGE_COLUMNS, columns, strict=True)))
