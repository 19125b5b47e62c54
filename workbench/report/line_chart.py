"""A line chart as an SVG picture: axes, grid, legend, lines that may have gaps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from math import ceil, floor, log10

WIDTH, HEIGHT = 760.0, 440.0
LEFT, RIGHT, TOP, BOTTOM = 76.0, 20.0, 64.0, 52.0
MOST_TICKS = 8
LEGEND_STEP = 215.0
LEGEND_COLUMNS = 3


@dataclass(frozen=True)
class Series:
    """One line."""

    name: str
    points: Sequence[tuple[float, float | None]]
    """In the order they are joined; None makes a gap."""
    color: str
    width: float = 1.5
    dash: str = ""
    """As SVG's stroke-dasharray."""


@dataclass(frozen=True)
class LineChart:
    """A chart with linear axes; what lies outside the limits is cut off."""

    title: str
    x_label: str
    y_label: str
    series: Sequence[Series]
    x_limits: tuple[float, float]
    y_limits: tuple[float, float]

    def x(self, value: float) -> float:
        """Place across the picture."""
        low, high = self.x_limits
        return LEFT + (value - low) / (high - low) * (WIDTH - LEFT - RIGHT)

    def y(self, value: float) -> float:
        """Place down the picture."""
        low, high = self.y_limits
        return HEIGHT - BOTTOM - (value - low) / (high - low) * (HEIGHT - TOP - BOTTOM)

    def svg(self) -> str:
        """The picture."""
        return "\n".join(
            [
                f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:g} {HEIGHT:g}"'
                f' width="{WIDTH:g}" height="{HEIGHT:g}" font-family="sans-serif" font-size="12">',
                '<rect width="100%" height="100%" fill="white"/>',
                f'<clipPath id="plot">{self._frame("rect")}/></clipPath>',
                *self._grid(),
                f'{self._frame("rect")} fill="none" stroke="black"/>',
                *self._labels(),
                *(line for one in self.series for line in self._line(one)),
                *self._legend(),
                "</svg>\n",
            ]
        )

    def _frame(self, tag: str) -> str:
        width, height = WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM
        return f'<{tag} x="{LEFT:g}" y="{TOP:g}" width="{width:g}" height="{height:g}"'

    def _grid(self) -> Iterator[str]:
        low, bottom = LEFT, HEIGHT - BOTTOM
        for value in ticks(*self.x_limits):
            x = self.x(value)
            yield _stroke(x, TOP, x, bottom, "#ddd")
            yield _text(x, bottom + 17, f"{value:g}", "middle")
        for value in ticks(*self.y_limits):
            y = self.y(value)
            yield _stroke(low, y, WIDTH - RIGHT, y, "#888" if value == 0 else "#ddd")
            yield _text(low - 6, y + 4, f"{value:g}", "end")

    def _labels(self) -> Iterator[str]:
        middle = TOP + (HEIGHT - TOP - BOTTOM) / 2
        yield _text(LEFT, 20, self.title, "start", 'font-size="14" font-weight="bold"')
        yield _text(LEFT + (WIDTH - LEFT - RIGHT) / 2, HEIGHT - 12, self.x_label, "middle")
        yield _text(18, middle, self.y_label, "middle", f'transform="rotate(-90 18 {middle:g})"')

    def _line(self, one: Series) -> Iterator[str]:
        dash = f' stroke-dasharray="{one.dash}"' if one.dash else ""
        for run in _runs(one.points):
            places = " ".join(f"{self.x(x):.2f},{self.y(y):.2f}" for x, y in run)
            yield (
                f'<polyline points="{places}" fill="none" stroke="{one.color}"'
                f' stroke-width="{one.width:g}"{dash} clip-path="url(#plot)"/>'
            )

    def _legend(self) -> Iterator[str]:
        for number, one in enumerate(self.series):
            row, column = divmod(number, LEGEND_COLUMNS)
            x, y = LEFT + LEGEND_STEP * column, 36 + 16.0 * row
            dash = f' stroke-dasharray="{one.dash}"' if one.dash else ""
            yield (
                f'<line x1="{x:g}" y1="{y:g}" x2="{x + 26:g}" y2="{y:g}" stroke="{one.color}"'
                f' stroke-width="{one.width:g}"{dash}/>'
            )
            yield _text(x + 31, y + 4, one.name, "start")


def ticks(low: float, high: float) -> list[float]:
    """Round numbers from `low` to `high`: multiples of 1, 2 or 5 times a power of ten."""
    rough = (high - low) / MOST_TICKS
    power = 10.0 ** floor(log10(rough))
    step = next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= rough * (1 - 1e-9))
    first, last = ceil(low / step - 1e-9), floor(high / step + 1e-9)
    return [float(f"{n * step:.12g}") for n in range(first, last + 1)]


def _runs(points: Sequence[tuple[float, float | None]]) -> Iterator[list[tuple[float, float]]]:
    """Stretches without a gap."""
    run: list[tuple[float, float]] = []
    for x, y in points:
        if y is not None:
            run.append((x, y))
        elif run:
            yield run
            run = []
    if run:
        yield run


def _stroke(x1: float, y1: float, x2: float, y2: float, color: str) -> str:
    return f'<line x1="{x1:.2f}" y1="{y1:.2f}" x2="{x2:.2f}" y2="{y2:.2f}" stroke="{color}"/>'


def _text(x: float, y: float, text: str, anchor: str, more: str = "") -> str:
    return f'<text x="{x:.2f}" y="{y:.2f}" text-anchor="{anchor}" {more}>{escape(text)}</text>'
