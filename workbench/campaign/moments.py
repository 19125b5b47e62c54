"""Statistics of errors and their stated deviations, added up chunk by chunk."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from workbench.model.arrays import FloatArray
from workbench.model.chart import Axis, Band, Chart, LimitLine, Series
from workbench.model.table import PERCENT, Column

COVERED = 0.95
"""Stated coverage of the intervals."""
QUANTILE = 1.959963984540054
"""Half width of such an interval of a normal distribution, in standard deviations."""
BIN_WIDTH, REACH = 0.25, 5.0
"""Bins of z: width and outermost edge; what lies beyond is counted in no bin."""
CHANCE_SD = 3.0
"""Half width of the band of chance about the stated coverage, in standard deviations."""


@dataclass
class Moments:
    """Sums over errors with stated standard deviations; NaN errors are left out."""

    count: int = 0
    """Number of errors, infinite ones included."""
    infinite: int = 0
    """Number of errors without a finite value or deviation; their intervals do not count as covering."""
    covered: int = 0
    sum_error: float = 0.0
    sum_squared_error: float = 0.0
    sum_variance: float = 0.0

    def add(self, error: pd.Series[float], sd: pd.Series[float]) -> FloatArray:
        """Add errors (n,) with deviations (n,); returns the finite errors in standard deviations."""
        seen = ~np.isnan(error.to_numpy())
        e, s = error.to_numpy()[seen], sd.to_numpy()[seen]
        finite = np.isfinite(e) & np.isfinite(s)
        self.count += len(e)
        self.infinite += int((~finite).sum())
        e, s = e[finite], s[finite]
        self.covered += int((np.abs(e) < QUANTILE * s).sum())
        self.sum_error += float(e.sum())
        self.sum_squared_error += float((e**2).sum())
        self.sum_variance += float((s**2).sum())
        return np.asarray(e / s)

    @classmethod
    def together(cls, parts: Iterable[Moments]) -> Moments:
        """Sums over several sets of errors."""
        whole = cls()
        for part in parts:
            for name, value in vars(part).items():
                setattr(whole, name, getattr(whole, name) + value)
        return whole

    @property
    def coverage(self) -> float:
        """Share of all errors within their intervals; NaN without errors."""
        return self.covered / self.count if self.count else float("nan")

    @property
    def mean_error(self) -> float:
        """Mean of the finite errors."""
        return self._mean(self.sum_error)

    @property
    def rms_error(self) -> float:
        """Root mean square of the finite errors."""
        return float(np.sqrt(self._mean(self.sum_squared_error)))

    @property
    def stated_sd(self) -> float:
        """Root mean square of their stated deviations."""
        return float(np.sqrt(self._mean(self.sum_variance)))

    def _mean(self, total: float) -> float:
        finite = self.count - self.infinite
        return total / finite if finite else float("nan")


@dataclass
class ZHistogram:
    """Histogram of errors in stated standard deviations."""

    total: int = 0
    counts: FloatArray = field(default_factory=lambda: np.zeros(round(2 * REACH / BIN_WIDTH)))

    def add(self, z: FloatArray) -> None:
        """Add values (n,)."""
        self.total += len(z)
        self.counts += np.histogram(z, bins=len(self.counts), range=(-REACH, REACH))[0]

    def density(self) -> FloatArray:
        """(bins,) share of the values per unit of z."""
        return np.asarray(self.counts / (max(self.total, 1) * BIN_WIDTH))


def coverage_column() -> Column:
    """Column of `Moments.coverage`."""
    return Column(key="coverage_95", name="coverage of 95 %", unit="%", format=".2f", scale=PERCENT)


def coverage_chart(lines: Mapping[str, Mapping[float, Moments]]) -> Chart:
    """Coverage of ranges: a series for each laser, with the band in which chance leaves it."""
    series: list[Series] = []
    fewest: dict[float, int] = {}
    for name, by_range in lines.items():
        seen = {at: m for at, m in sorted(by_range.items()) if m.count}
        series.append(Series(name=name, x=tuple(seen), y=tuple(PERCENT * m.coverage for m in seen.values())))
        for at, m in seen.items():
            fewest[at] = min(m.count, fewest.get(at, m.count))
    x = tuple(sorted(fewest))
    half = [PERCENT * CHANCE_SD * np.sqrt(COVERED * (1 - COVERED) / fewest[one]) for one in x]
    low, high = ([PERCENT * COVERED + sign * one for one in half] for sign in (-1, 1))
    band = Band(name="95 % by chance (3 sd)", x=x, low=tuple(low), high=tuple(high))
    return Chart(
        name="coverage",
        title="Share of errors within the interval of 95 %",
        x=Axis(label="range", unit="mm", scale="log"),
        y=Axis(label="coverage", unit="%"),
        series=tuple(series),
        bands=(band,) if x else (),
        limits=(LimitLine(name="stated", y=PERCENT * COVERED),),
    )


def z_chart(histograms: Mapping[str, ZHistogram]) -> Chart:
    """Distributions of errors in stated standard deviations, with the normal distribution."""
    edges = np.linspace(-REACH, REACH, round(2 * REACH / BIN_WIDTH) + 1)
    centre = (edges[1:] + edges[:-1]) / 2
    normal = np.exp(-(centre**2) / 2) / np.sqrt(2 * np.pi)
    x = tuple(centre.tolist())
    series = [Series(name=name, x=x, y=tuple(one.density().tolist())) for name, one in histograms.items()]
    return Chart(
        name="z",
        title="Errors in stated standard deviations; line: normal distribution",
        x=Axis(label="error / stated sd"),
        y=Axis(label="density"),
        series=(*series, Series(name="normal", x=x, y=tuple(normal.tolist()), style="line")),
    )
