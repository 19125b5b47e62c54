"""Scale of a chart's axis: ends, positions and round ticks, the same for every renderer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, floor, log10

from workbench.model.chart import Axis, Chart

MARGIN = 0.05
"""Share of the axis left blank at each end if the ends are derived from the data."""
MOST_TICKS = 8
LEAST_LOG_TICKS = 2
"""Minimum number of logarithmic ticks; an axis with fewer gets linear ticks."""
LEAST_DIGITS, MOST_DIGITS = 4, 12
"""Numbers of digits in the label of a tick."""
MOST_LABELLED = 30
"""Largest number of distinct x values that each get a tick; with more, ticks are round numbers."""
ROUNDING = 1e-12
"""Relative difference of values that are one."""
SAME_PLACE = 0.003
"""Values of x that are closer than this share of the axis, a few pixels, have one tick."""


@dataclass(frozen=True)
class Scale:
    """An axis from `low` to `high`, in its unit."""

    low: float
    high: float
    is_log: bool

    def share(self, value: float) -> float:
        """Position along the axis: 0 at the low end, 1 at the high end; at least 0 on a logarithmic axis."""
        if self.is_log:
            return log10(max(value, self.low) / self.low) / log10(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def round_ticks(self) -> list[float]:
        """Round numbers along the axis, about ten at most."""
        return _log_ticks(self.low, self.high) if self.is_log else linear_ticks(self.low, self.high)


def x_scale(chart: Chart) -> Scale:
    """Scale of x: the limits of the axis, or the extent of the data with a margin."""
    return _scale(chart.x, sorted({*chart.x_values(), *(x for band in chart.bands for x in band.x)}))


def y_scale(chart: Chart) -> Scale:
    """Scale of y; symmetric if values lie on both sides of zero, as errors do."""
    values = chart.y_values()
    if chart.y.limits is None and chart.y.scale == "linear" and values and values[0] < 0 < values[-1]:
        largest = max(-values[0], values[-1])
        values = [-largest, largest]
    return _scale(chart.y, values)


def x_ticks(chart: Chart, scale: Scale, least_distance: float) -> tuple[list[float], list[float]]:
    """Values of x to label, in two rows: the data's own values if they are few, else round numbers.

    Neighbours in a row are at least `least_distance` apart (a share of the axis). The first row contains the
    first and the last value; the second row, below it, contains values that do not fit into the first.
    """
    own = _thinned([x for x in chart.x_values() if 0 <= scale.share(x) <= 1], scale, SAME_PLACE)
    if not 0 < len(own) <= MOST_LABELLED:
        return _thinned(scale.round_ticks(), scale, least_distance), []
    first = _thinned(own, scale, least_distance)
    return first, _thinned([x for x in own if x not in first], scale, least_distance)


def tick_texts(ticks: Sequence[float]) -> list[str]:
    """Labels of ticks with as few digits as distinguish them, but at least `LEAST_DIGITS`."""
    for digits in range(LEAST_DIGITS, MOST_DIGITS):
        texts = [f"{float(f'{tick:.{digits}g}'):.{MOST_DIGITS}g}" for tick in ticks]
        if len(set(texts)) == len(set(ticks)):
            return texts
    return [f"{tick:.{MOST_DIGITS}g}" for tick in ticks]


def linear_ticks(low: float, high: float) -> list[float]:
    """Multiples of 1, 2 or 5 times a power of ten from `low` to `high`."""
    rough = (high - low) / MOST_TICKS
    power = 10.0 ** floor(log10(rough))
    step = next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= rough * (1 - 1e-9))
    first, last = ceil(low / step - 1e-9), floor(high / step + 1e-9)
    return [float(f"{n * step:.12g}") for n in range(first, last + 1)]


def _scale(axis: Axis, values: Sequence[float]) -> Scale:
    is_log = axis.scale == "log"
    if axis.limits is not None:
        return Scale(*axis.limits, is_log)
    if is_log:
        logs = [log10(v) for v in values if v > 0] or [0.0]
        low, high = _padded(logs[0], logs[-1], 0.5)
        return Scale(10**low, 10**high, is_log)
    low, high = (values[0], values[-1]) if values else (0.0, 0.0)
    return Scale(*_padded(low, high, abs(low) or 1.0), is_log)


def _padded(low: float, high: float, least_half: float) -> tuple[float, float]:
    """Ends with margin; one value, or several that differ by rounding, get `least_half` on each side."""
    if high - low <= ROUNDING * max(abs(low), abs(high)):
        return low - least_half, high + least_half
    margin = MARGIN * (high - low) / (1 - 2 * MARGIN)
    return low - margin, high + margin


def _log_ticks(low: float, high: float) -> list[float]:
    exponents = range(floor(log10(low)), ceil(log10(high)) + 1)
    factors = (1.0, 2.0, 5.0) if log10(high / low) < MOST_TICKS / 3 else (1.0,)
    ticks = [float(f"{m}e{e}") for e in exponents for m in factors]
    inside = [tick for tick in ticks if low * (1 - 1e-9) <= tick <= high * (1 + 1e-9)]
    return inside if len(inside) >= LEAST_LOG_TICKS else linear_ticks(low, high)


def _thinned(values: Sequence[float], scale: Scale, least_distance: float) -> list[float]:
    """Values at least `least_distance` apart, including the first and the last."""
    kept = list(values[:1])
    for value in values[1:]:
        if scale.share(value) - scale.share(kept[-1]) >= least_distance:
            kept.append(value)
        elif value == values[-1]:  # replaces its neighbour, unless that is the first
            kept[max(1, len(kept) - 1) :] = [value]
    return kept
