"""Uncertainty of a single range from 0.1 to 5 m: table and chart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, isfinite, nan, sqrt

import numpy as np

from workbench.model.calibration import Calibration
from workbench.model.chart import Axis, Band, Chart, Series
from workbench.model.table import Column, Table
from workbench.report.certificate.coverage import expanded_range
from workbench.sensor.calibrated import CalibratedSensor
from workbench.sensor.range_model import RangeEstimates
from workbench.trials.errors import EXPANSION
from workbench.trials.statistics.welch_satterthwaite import CombinedUncertainty

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
    mean_k: float = EXPANSION
    """Coverage factor of the mean."""
    mean_degrees_of_freedom: float | None = None
    """Effective degrees of freedom of the mean's uncertainty; None: infinite."""
    laser_k: Mapping[str, float] = field(default_factory=dict)
    """Coverage factor of each laser that sees the range."""

    @property
    def mean_expanded_mm(self) -> float | None:
        """Expanded uncertainty of the mean, mm."""
        return None if self.mean_sd_mm is None else self.mean_k * self.mean_sd_mm

    @property
    def laser_expanded_mm(self) -> Mapping[str, float | None]:
        """Expanded uncertainty of each laser, mm; None where it does not see the range."""
        return {
            i: None if sd is None else self.laser_k.get(i, EXPANSION) * sd
            for i, sd in self.laser_sd_mm.items()
        }


def range_uncertainties(calibration: Calibration, ranges_mm: Sequence[float]) -> tuple[RangeUncertainty, ...]:
    """Standard uncertainty of a single range at each distance, for spots with the calibration's noise."""
    sensor = CalibratedSensor(calibration)
    nearest, farthest = calibration.laser_ranger.validity.standoff_mm
    at = np.array(ranges_mm, float)
    seen = {i: sensor.in_frame(i, at) for i in sensor.ids}
    single = {i: sensor.typical_ranges(i, at) for i in sensor.ids}
    found = []
    for n, range_mm in enumerate(at.tolist()):
        own = [i for i in sensor.ids if seen[i][n]]
        mean = _mean(sensor, own, range_mm)
        lasers = {i: _laser(single[i], n, calibration) for i in own}
        nu = mean.degrees_of_freedom
        found.append(
            RangeUncertainty(
                range_mm,
                _finite(mean.u),
                {i: _finite(lasers[i].u) if i in lasers else None for i in sensor.ids},
                nearest <= range_mm <= farthest,
                mean.k,
                nu if isfinite(nu) else None,
                {i: one.k for i, one in lasers.items()},
            )
        )
    return tuple(found)


def table_mm(calibration: Calibration) -> tuple[float, ...]:
    """Distances of the table: round ones, and both ends of the standoffs that the calibration covers."""
    return tuple(sorted({*ROUND_MM, *calibration.laser_ranger.validity.standoff_mm}))


def curve_mm(calibration: Calibration) -> tuple[float, ...]:
    """Distances of the chart: the standoffs that the calibration covers, evenly on a logarithmic axis."""
    nearest, farthest = calibration.laser_ranger.validity.standoff_mm
    return tuple(np.geomspace(nearest, farthest, CURVE_POINTS).tolist())


def uncertainty_table(found: Sequence[RangeUncertainty]) -> Table:
    """Expanded uncertainty at each distance: of the mean, and of each laser if they are few."""
    ids = list(found[0].laser_sd_mm) if found else []
    shown = ids if len(ids) <= MOST_LASERS else []
    return Table(
        name="range_uncertainty",
        title="Expanded uncertainty U (95.45 %) of a single range",
        columns=(
            Column(key="range_mm", name="range", unit="mm", format="g"),
            Column(key="mean_expanded_mm", name="U, mean of lasers", unit="mm", format="sd"),
            Column(key="mean_relative_expanded", name="U, mean of lasers", unit="%", scale=100, format="sd"),
            Column(key="mean_k", name="its k", format=".2f"),
            Column(key="mean_degrees_of_freedom", name="its nu", format=".1f"),
            Column(key="best_expanded_mm", name="U, best laser", unit="mm", format="sd"),
            Column(key="worst_expanded_mm", name="U, worst laser", unit="mm", format="sd"),
            *(Column(key=f"expanded_mm.{i}", name=f"U, {i}", unit="mm", format="sd") for i in shown),
            Column(key="remark", name="remark"),
        ),
        rows=tuple(_row(one, shown) for one in found),
        caption=(
            "U -: no spot in the image. k and nu: of the mean; nu -: infinite. Extrapolated: outside the"
            " covered standoffs, not certified."
        ),
    )


def uncertainty_chart(found: Sequence[RangeUncertainty]) -> Chart:
    """Expanded relative uncertainty over range: mean of the lasers, and the lasers' band."""
    seen = [one for one in found if one.mean_sd_mm is not None]
    spans = [(one, _lasers(one)) for one in seen]
    return Chart(
        name="range_uncertainty",
        title="Expanded uncertainty U (95.45 %) of a single range",
        x=Axis(label="range", unit="mm", scale="log"),
        y=Axis(label="U / range", unit="%", scale="log"),
        series=(
            Series(
                name="mean of lasers",
                x=tuple(one.range_mm for one in seen),
                y=tuple(_percent(one.mean_expanded_mm, one) for one in seen),
                style="line",
            ),
        ),
        bands=(
            Band(
                name="best to worst laser",
                x=tuple(one.range_mm for one, _ in spans),
                low=tuple(_percent(min(expanded), one) or 0.0 for one, expanded in spans),
                high=tuple(_percent(max(expanded), one) or 0.0 for one, expanded in spans),
            ),
        ),
    )


def _mean(sensor: CalibratedSensor, ids: list[str], range_mm: float) -> CombinedUncertainty:
    """Uncertainty of the mean of the lasers' ranges, weighted by their spots; NaN without one."""
    if not ids:
        return CombinedUncertainty(nan, inf, EXPANSION)
    spots = np.concatenate([sensor.spot_px(i, np.array([range_mm])) for i in ids])
    found = sensor.ranges(ids, spots, np.full_like(spots, np.nan))
    weight = 1.0 / found.spot_sd_mm**2
    weight /= weight.sum()
    spot_variance = float(weight**2 @ found.spot_sd_mm**2)
    variance = float(weight @ found.covariance_mm2 @ weight)
    return _expanded(spot_variance, variance, sensor.calibration)


def _laser(estimates: RangeEstimates, n: int, calibration: Calibration) -> CombinedUncertainty:
    """Uncertainty of one laser's range, the n-th of its estimates."""
    return _expanded(float(estimates.spot_sd_mm[n] ** 2), float(estimates.covariance_mm2[n, n]), calibration)


def _expanded(spot_variance: float, variance: float, calibration: Calibration) -> CombinedUncertainty:
    parameter_sd = np.sqrt(np.maximum(variance - spot_variance, 0.0))
    return expanded_range(sqrt(spot_variance), float(parameter_sd), calibration.laser_ranger.fit)


def _lasers(one: RangeUncertainty) -> list[float]:
    return [expanded for expanded in one.laser_expanded_mm.values() if expanded is not None]


def _percent(expanded_mm: float | None, one: RangeUncertainty) -> float | None:
    return None if expanded_mm is None else 100.0 * expanded_mm / one.range_mm


def _row(one: RangeUncertainty, shown: Sequence[str]) -> tuple[float | str | None, ...]:
    lasers, mean = _lasers(one), one.mean_expanded_mm
    return (
        one.range_mm,
        mean,
        None if mean is None else mean / one.range_mm,
        None if mean is None else one.mean_k,
        one.mean_degrees_of_freedom,
        min(lasers, default=None),
        max(lasers, default=None),
        *(one.laser_expanded_mm[i] for i in shown),
        "" if one.inside else "extrapolated",
    )


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
