"""Readings of the ranger on the terminal: one line each, with details only for unusual readings."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import degrees
from typing import TYPE_CHECKING

from rich.cells import cell_len, set_cell_size
from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.console import Group as Lines
from rich.padding import Padding
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

from workbench.model.number_text import counted, with_sd

if TYPE_CHECKING:  # rendering needs none of the ranging code
    from workbench.ranging.ranger import Reading
    from workbench.ranging.shape import Shape

LONGEST_SCENE = 30
"""Largest number of characters of a scene name that shares a line with its results."""
CLOSEST = "closest"


def reading_list(readings: Sequence[Reading]) -> Lines:
    """One line per scene; below it ranges of the lasers and notes, if it is not done or has notes."""
    names = [len(r.scene) for r in readings if len(r.scene) <= LONGEST_SCENE]
    widths = max([*names, len("scene")]), max([*(len(_closest(r)) for r in readings), len(CLOSEST)])
    lines: list[RenderableType] = [
        Text("Ranges (mm, 1 sigma)", style="italic"),
        _Row(widths, "scene", CLOSEST, "shape", style="bold"),
    ]
    for reading in readings:
        lines += _lines(reading, widths)
    lines.append(Text(_counted(readings)))
    return Lines(*lines)


def reading_line(r: Reading) -> str:
    """Summary of a reading in one line, 1 sigma; the 95 % interval is in the JSON."""
    if r.closest_mm is None or r.sigma_mm is None or r.interval_mm is None:
        return f"{r.scene}  {r.status}  {'; '.join(r.notes)}"
    return f"{r.scene}  {r.status}  {_closest(r)} mm  {_shapes(r)} (1 sigma)  {_lasers(r)}"


def shape_words(shape: Shape) -> str:
    """Description of a shape in a few words, 1 sigma."""
    if shape.kind == "incline" and shape.angle_rad is not None and shape.angle_sigma_rad is not None:
        return f"incline {with_sd(degrees(shape.angle_rad), degrees(shape.angle_sigma_rad))} deg"
    if shape.kind == "cylinder" and shape.cylinder is not None:
        return f"cylinder, radius {with_sd(shape.cylinder.radius_mm, shape.cylinder.radius_sigma_mm)}"
    return f"round, degree {shape.degree}" if shape.kind == "round" else shape.kind


def _lines(r: Reading, widths: tuple[int, int]) -> Iterator[RenderableType]:
    done = r.status == "done"
    words = _shapes(r) if done else "; ".join(part for part in (_status(r.status), _shapes(r)) if part)
    if len(r.scene) > LONGEST_SCENE:
        yield Text(r.scene, overflow="fold")
    yield _Row(widths, r.scene if len(r.scene) <= LONGEST_SCENE else "", _closest(r), words)
    if not done or r.notes:
        for more in (_lasers(r), *r.notes):
            if more:
                yield Padding(Text(more), (0, 0, 0, 4))


@dataclass(frozen=True)
class _Row:
    """Scene, closest range and words; the words are folded in their column where they do not fit."""

    widths: tuple[int, int]
    """Width of the first two columns."""
    scene: str
    closest: str
    words: str
    style: str = ""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Render a line that fits as it is: a table takes ten times as long, and scenes are thousands."""
        scene, closest = set_cell_size(self.scene, self.widths[0]), self.closest.rjust(self.widths[1])
        line = f"{scene}  {closest}  {self.words}"
        if line.isprintable() and cell_len(line) <= options.max_width:
            yield Segment(line, console.get_style(self.style))
            yield Segment.line()
        else:
            yield self.table

    @property
    def table(self) -> Table:
        """The row as a table of its own."""
        row = Table.grid(padding=(0, 2, 0, 0))
        row.add_column(width=self.widths[0], no_wrap=True)
        row.add_column(width=self.widths[1], justify="right", no_wrap=True)
        row.add_column(overflow="fold")
        row.add_row(*(Text(cell, style=self.style) for cell in (self.scene, self.closest, self.words)))
        return row


def _closest(r: Reading) -> str:
    return "-" if r.closest_mm is None or r.sigma_mm is None else with_sd(r.closest_mm, r.sigma_mm)


def _shapes(r: Reading) -> str:
    return ", ".join(shape_words(line.shape) for line in r.shapes)


def _lasers(r: Reading) -> str:
    return " ".join(f"{laser.laser_id} {laser.range_mm:.1f}" for laser in r.lasers)


def _status(status: str) -> str:
    return status.replace("_", " ")


def _counted(readings: Sequence[Reading]) -> str:
    counts = Counter(_status(r.status) for r in readings)
    scenes = counted(len(readings), "scene")
    return f"{scenes}: {', '.join(f'{n} {status}' for status, n in counts.items())}; ranges of lasers: --json"
