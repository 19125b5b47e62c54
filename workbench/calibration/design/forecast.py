"""Forecast of a calibration at given standoffs: sd of parameters and ranges, before any data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.calibration.design.expectation import Expectation
from workbench.calibration.design.standoffs import RangeGoals, drawn_sensors, mean_sd_px, posterior, worst_of
from workbench.calibration.estimation.fit import share_of
from workbench.calibration.model.parameters import ParameterTable, sensor_parameters
from workbench.calibration.verdict.assessment import basis
from workbench.calibration.verdict.observability import (
    NullDirection,
    RangeGradients,
    information_of,
    null_directions,
)
from workbench.model.arrays import BoolArray, FloatArray
from workbench.model.calibration import DeterminedBy
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig

RANGES_MM = (100.0, 150.0, 200.0, 300.0, 500.0, 700.0, 1000.0, 1500.0, 2000.0, 3000.0, 4000.0, 5000.0)
OFTEN = 0.05
"""Share of the drawn sensors with a spot outside the image above which a note is made."""


@dataclass(frozen=True)
class ParameterForecast:
    """Forecast of one parameter; 1 sigma, of the median sensor."""

    name: str
    unit: str
    prior_sd: float
    sd: float
    data_share: float
    determined_by: DeterminedBy


@dataclass(frozen=True)
class RangeForecast:
    """Forecast of a single range by one spot; relative, 1 sigma, of the median sensor that sees the spot."""

    laser_id: str
    range_mm: float
    relative_sd: float | None
    """None: the spot is outside the image in more than half of the sensors."""
    relative_sd_of_calibration: float | None
    """Part of the calibration, without the noise of the ranged spot."""


@dataclass(frozen=True)
class CalibrationForecast:
    """Forecast of a calibration."""

    standoffs_mm: tuple[float, ...]
    repeats: int
    parameters: tuple[ParameterForecast, ...]
    ranges: tuple[RangeForecast, ...]
    worst_relative_sd: float
    """The largest of all ranges from 0.1 to 5 m and all lasers."""
    worst_relative_sd_of_calibration: float
    directions: tuple[NullDirection, ...]
    """Null directions of the sensor at the prior means."""
    notes: tuple[str, ...]


def forecast(rig: Rig, standoffs_mm: Sequence[float], repeats: int) -> CalibrationForecast:
    """Predict a calibration at these standoffs, with `repeats` captures of each laser at each.

    Raises:
        BadInputError: a standoff at which no laser has its spot in the image.
    """
    sensors = drawn_sensors(rig)
    standoffs = np.array(standoffs_mm)
    notes = _out_of_image(sensors, standoffs)
    goals = RangeGoals.of(sensors, np.array(RANGES_MM), rig.noise)
    rows = sensors.spot_rows(standoffs, mean_sd_px(rig.noise, repeats))
    covariance = posterior(rows[..., sensors.table.free])
    variance = goals.variance(covariance)
    return CalibrationForecast(
        standoffs_mm=tuple(standoffs_mm),
        repeats=repeats,
        parameters=_parameters(sensors, covariance),
        ranges=_ranges(rig, goals, variance),
        worst_relative_sd=float(worst_of(variance + goals.spot_sd**2)),
        worst_relative_sd_of_calibration=float(worst_of(variance)),
        directions=_directions(rig, standoffs, repeats),
        notes=notes,
    )


def _parameters(sensors: Expectation, covariance: FloatArray) -> tuple[ParameterForecast, ...]:
    free = sensors.table.free.tolist()
    sd = np.median(np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)), axis=0).tolist()
    share = np.median(share_of(information_of(covariance)), axis=0).tolist()
    parameters = [sensors.table.parameters[i] for i in free]
    return tuple(
        ParameterForecast(p.name, p.unit, p.prior.sd, s * p.prior.sd, part, basis(part, s, 1.0))
        for p, s, part in zip(parameters, sd, share, strict=True)
    )


def _ranges(rig: Rig, goals: RangeGoals, variance: FloatArray) -> tuple[RangeForecast, ...]:
    seen = goals.spot_sd > 0
    with np.errstate(invalid="ignore"):
        own = _median_seen(np.sqrt(variance), seen)
        total = _median_seen(np.sqrt(variance + goals.spot_sd**2), seen)
    places = [(laser, at) for at in RANGES_MM for laser in rig.laser_ids]
    return tuple(RangeForecast(laser, at, t, c) for (laser, at), t, c in zip(places, total, own, strict=True))


def _median_seen(values: FloatArray, seen: BoolArray) -> list[float | None]:
    """Medians of (N, K) values over the sensors that see the spot; None where less than half of them do."""
    return [
        float(np.median(column[has])) if has.mean() >= 0.5 else None
        for column, has in zip(values.T, seen.T, strict=True)
    ]


def _directions(rig: Rig, standoffs: FloatArray, repeats: int) -> tuple[NullDirection, ...]:
    """Null directions of the sensor at the prior means; drawn lens terms would resolve some of them."""
    table = ParameterTable(sensor_parameters(rig))
    expected = Expectation(rig, table.prior_mean[None])
    rows = expected.spot_rows(standoffs, mean_sd_px(rig.noise, repeats))[..., table.free]
    sd = table.prior_sd[table.free]
    covariance = np.zeros((len(table.prior_sd), len(table.prior_sd)))
    covariance[np.ix_(table.free, table.free)] = posterior(rows)[0] * np.outer(sd, sd)
    goals = RangeGoals.of(expected, np.array(RANGES_MM), rig.noise)
    seen = goals.spot_sd[0] > 0
    by_parameter = np.zeros((int(seen.sum()), len(table.prior_sd)))
    by_parameter[:, table.free] = goals.by_parameter[0, seen] / sd
    total = np.sqrt(goals.variance(posterior(rows)) + goals.spot_sd**2)[0, seen]
    return null_directions(
        rig, table.parameters, table.prior_mean, covariance, RangeGradients(by_parameter, total)
    )


def _out_of_image(sensors: Expectation, standoffs: FloatArray) -> tuple[str, ...]:
    """Notes on spots outside the image.

    Raises:
        BadInputError: a standoff at which no laser has its spot in the image.
    """
    share = 1.0 - sensors.in_frame(standoffs).mean(axis=0)
    notes = []
    for standoff, missing in zip(standoffs.tolist(), share, strict=True):
        if (missing == 1).all():
            raise BadInputError(
                f"standoff {standoff:g} mm: expected a laser's spot in the image, there is none; check the"
                " standoff, and baselines, pointing and image size in the rig file"
            )
        often = {i: m for i, m in zip(sensors.rig.laser_ids, missing.tolist(), strict=True) if m > OFTEN}
        if often:
            text = ", ".join(f"{100 * m:.0f} % ({i})" for i, m in often.items())
            notes.append(f"at {standoff:g} mm the spot is outside the image in {text} of the drawn sensors")
    return tuple(notes)
