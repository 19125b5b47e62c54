"""Uncertainty of a single range from 0.1 to 5 m: table and chart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from workbench.model.calibration import Calibration
from workbench.model.chart import Axis, Band, Chart, Series
from workbench.model.table import Column, Table
from workbench.sensor.calibrated import CalibratedSensor
from workbench.trials.errors import EXPANSION

ROUND_MM = (100, 150, 200, 300, 500, 700, 1000, 1500, 2000, 3000, 4000, 5000)
CURVE_POINTS = 60
MOST_LASERS = 8
"""Largest number of lasers that each get a column."""


@dataclass(frozen=True)
class RangeUncertainty:
    """Uncertainty of a single range at one distance; mm, 1 sigma; None where no laser sees the range."""

    range_mm: float
    mean_sd_mm: float | None
    """Of the mean of all lasers, weighted by the uncertainty of their spots."""
    laser_sd_mm: Mapping[str, float | None] = field(default_factory=dict)
    inside: bool = True
    """Whether the range lies within the standoffs that the calibration covers."""


def range_uncertainties(calibration: Calibration, ranges_mm: Sequence[float]) -> tuple[RangeUncertainty, ...]:
    """Standard uncertainty of a single range at each distance, for spots with the calibration's noise."""
    sensor = CalibratedSensor(calibration)
    nearest, farthest = calibration.laser_ranger.validity.standoff_mm
    at = np.array(ranges_mm, float)
    seen = {i: sensor.in_frame(i, at) for i in sensor.ids}
    sd = {i: np.where(seen[i], sensor.typical_ranges(i, at).sigma_mm, np.nan) for i in sensor.ids}
    return tuple(
        RangeUncertainty(
            range_mm,
            _finite(_mean_sd_mm(sensor, [i for i in sensor.ids if seen[i][n]], range_mm)),
            {i: _finite(float(sd[i][n])) for i in sensor.ids},
            nearest <= range_mm <= farthest,
        )
        for n, range_mm in enumerate(at.tolist())
    )


def table_mm(calibration: Calibration) -> tuple[float, ...]:
    """Distances of the table: round ones, and both ends of the standoffs that the calibration covers."""
    return tuple(sorted({*ROUND_MM, *calibration.laser_ranger.validity.standoff_mm}))


def curve_mm(calibration: Calibration) -> tuple[float, ...]:
    """Distances of the chart: the standoffs that the calibration covers, evenly on a logarithmic axis."""
    nearest, farthest = calibration.laser_ranger.validity.standoff_mm
    return tuple(np.geomspace(nearest, farthest, CURVE_POINTS).tolist())


def uncertainty_table(found: Sequence[RangeUncertainty]) -> Table:
    """Expanded uncertainty (k = 2) at each distance: of the mean, and of each laser if they are few."""
    ids = list(found[0].laser_sd_mm) if found else []
    shown = ids if len(ids) <= MOST_LASERS else []
    return Table(
        name="range_uncertainty",
        title="Expanded uncertainty U (k = 2, about 95 %) of a single range",
        columns=(
            Column(key="range_mm", name="range", unit="mm", format="g"),
            Column(key="mean_expanded_mm", name="U, mean of lasers", unit="mm", format="sd"),
            Column(key="mean_relative_expanded", name="U, mean of lasers", unit="%", scale=100, format="sd"),
            Column(key="best_expanded_mm", name="U, best laser", unit="mm", format="sd"),
            Column(key="worst_expanded_mm", name="U, worst laser", unit="mm", format="sd"),
            *(Column(key=f"expanded_mm.{i}", name=f"U, {i}", unit="mm", format="sd") for i in shown),
            Column(key="remark", name="remark"),
        ),
        rows=tuple(_row(one, shown) for one in found),
        caption="-: no spot in the image. Extrapolated: outside the covered standoffs, not certified.",
    )


def uncertainty_chart(found: Sequence[RangeUncertainty]) -> Chart:
    """Expanded relative uncertainty over range: mean of the lasers, and the lasers' band."""
    seen = [one for one in found if one.mean_sd_mm is not None]
    spans = [(one, _lasers(one)) for one in seen]
    return Chart(
        name="range_uncertainty",
        title="Expanded uncertainty U (k = 2) of a single range",
        x=Axis(label="range", unit="mm", scale="log"),
        y=Axis(label="U / range", unit="%", scale="log"),
        series=(
            Series(
                name="mean of lasers",
                x=tuple(one.range_mm for one in seen),
                y=tuple(_percent(one.mean_sd_mm, one) for one in seen),
                style="line",
            ),
        ),
        bands=(
            Band(
                name="best to worst laser",
                x=tuple(one.range_mm for one, _ in spans),
                low=tuple(_percent(min(sd), one) or 0.0 for one, sd in spans),
                high=tuple(_percent(max(sd), one) or 0.0 for one, sd in spans),
            ),
        ),
    )


def _mean_sd_mm(sensor: CalibratedSensor, ids: list[str], range_mm: float) -> float:
    """1 sigma of the mean of the lasers' ranges, weighted by the variance of their spots."""
    if not ids:
        return float("nan")
    spots = np.concatenate([sensor.spot_px(i, np.array([range_mm])) for i in ids])
    found = sensor.ranges(ids, spots, np.full_like(spots, np.nan))
    weight = 1.0 / found.spot_sd_mm**2
    weight /= weight.sum()
    return float(np.sqrt(weight @ found.covariance_mm2 @ weight))


def _lasers(one: RangeUncertainty) -> list[float]:
    return [sd for sd in one.laser_sd_mm.values() if sd is not None]


def _percent(sd_mm: float | None, one: RangeUncertainty) -> float | None:
    return None if sd_mm is None else 100.0 * EXPANSION * sd_mm / one.range_mm


def _expanded(sd_mm: float | None) -> float | None:
    return None if sd_mm is None else EXPANSION * sd_mm


def _row(one: RangeUncertainty, shown: Sequence[str]) -> tuple[float | str | None, ...]:
    lasers, mean = _lasers(one), _expanded(one.mean_sd_mm)
    return (
        one.range_mm,
        mean,
        None if mean is None else mean / one.range_mm,
        _expanded(min(lasers, default=None)),
        _expanded(max(lasers, default=None)),
        *(_expanded(one.laser_sd_mm[i]) for i in shown),
        "" if one.inside else "extrapolated",
    )


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
