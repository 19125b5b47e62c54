"""`python -m tests.proofs.shapes`: shapes, angles and intervals of the ranger against simulated surfaces.

Minutes; the tables go to docs/benchmarks, and the first two to docs/ranging.md, where a test reads them.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial

import numpy as np

from tests.proofs.calibrated_surfaces import DrawnSensors
from tests.proofs.shape_scores import angle_held, drawn_coverage
from tests.support.stored_output import store
from tests.support.surfaces import (
    F_PX,
    SD_PX,
    Surface,
    X,
    cubic,
    cylinder,
    fit_polynomial,
    flat,
    holds,
    incline,
    parabola,
    readings,
    seen,
    share,
)
from workbench.ranging.points import interval_mm
from workbench.ranging.shape import Shape

READINGS, SEED = 1000, 2001
DRAWN_SHAPES, DRAWN_SENSORS = 20_000, 50
CLOSEST_MM = (150, 300, 600, 1000, 1500, 2000, 3000, 4500)
FLAT = "flat"
ANGLES_DEG = {FLAT: 0.0, **{f"incline {angle} deg": float(angle) for angle in (5, 15, 30, 60)}}
LARGER_NOISE = 1.22
"""Noise where the speckle of 0.04 px is 1.5 times larger, relative to the stated one."""
Read = Callable[[Surface, int, int], list[Shape]]
"""Function of a surface, a number of readings, and a seed."""
BESIDE = partial(cylinder, axis_x_mm=20.0)


def _is(*kinds: str) -> Callable[[Shape], bool]:
    return lambda shape: shape.kind in kinds


ROWS: dict[str, tuple[Callable[[float], Surface], Callable[[Shape], bool]]] = {
    FLAT: (flat, _is("flat")),
    **{
        name: (partial(incline, angle_deg=angle), _is("incline"))
        for name, angle in ANGLES_DEG.items()
        if name != FLAT
    },
    "parabola 0.02 x^2": (parabola, _is("round")),
    "cubic 0.0003 (x + 60)^3": (cubic, lambda shape: shape.degree == 3),
    "cylinder, radius 89, axis at 20: cylinder": (BESIDE, _is("cylinder")),
    "the same: cylinder or round": (BESIDE, _is("cylinder", "round")),
    "cylinder on the axis: round": (cylinder, _is("cylinder", "round")),
}


@dataclass(frozen=True)
class Simulation:
    """Readings of every row and column, simulated on first use."""

    read: Read
    n: int = READINGS
    _cells: dict[tuple[object, int], list[Shape]] = field(default_factory=dict)

    def cell(self, name: str, at: int) -> list[Shape]:
        """Readings of a row with its closest point at a distance, mm; noise of its own in each column."""
        surface, _ = ROWS[name]
        if (surface, at) not in self._cells:
            shapes = self.read(surface(float(at)), self.n, SEED + at)
            self._cells[surface, at] = [_without_details(shape) for shape in shapes]
        return self._cells[surface, at]


def _without_details(shape: Shape) -> Shape:
    """The shape without arrays and tests, of which there is no room for all readings."""
    none = np.empty(0)
    return replace(shape, closest_by_range=none, closest_by_place=none, cylinder=None, tried=())


def shape_table(simulation: Simulation, closest_mm: Sequence[int] = CLOSEST_MM) -> Iterator[str]:
    """Rows as Markdown: right shape / interval with the true closest range, % of the readings."""
    yield from _head(closest_mm)
    for name, (_, is_right) in ROWS.items():
        yield _row(name, [_shape_cell(simulation.cell(name, at), is_right, float(at)) for at in closest_mm])


def _shape_cell(shapes: list[Shape], is_right: Callable[[Shape], bool], at: float) -> str:
    right, held = share(shapes, is_right), share(shapes, lambda shape: holds(shape, at))
    return f"{100 * right:.0f}/{100 * held:.0f}"


def angle_table(simulation: Simulation, closest_mm: Sequence[int] = CLOSEST_MM) -> Iterator[str]:
    """Rows as Markdown: coverage of the 95 % interval of the angle, % / bias, deg."""
    yield from _head(closest_mm)
    for name, angle in ANGLES_DEG.items():
        yield _row(name, [_angle_cell(simulation.cell(name, at), angle) for at in closest_mm])


def _angle_cell(shapes: list[Shape], angle_deg: float) -> str:
    angles = [np.degrees(s.angle_rad) for s in shapes if s.angle_rad is not None]
    held = np.mean(list(angle_held(shapes, angle_deg)))
    return f"{100 * held:.0f}/{np.mean(angles) - angle_deg:+.1f}"


def flat_table(closest_mm: Sequence[int] = CLOSEST_MM, n: int = READINGS) -> Iterator[str]:
    """Rows as Markdown about flats: length of the interval, other shapes, and larger noise."""
    yield from _head(closest_mm)
    stated = {at: readings(flat(at), n, SEED + at) for at in closest_mm}
    larger = {at: readings(flat(at), n, SEED + at, noise_scale=LARGER_NOISE) for at in closest_mm}
    lengths = {at: _lengths(shapes, at) for at, shapes in stated.items()}
    yield _row("interval / that of the flat fit, mean", [f"{of.mean():.2f}" for of in lengths.values()])
    yield _row("the same, median", [f"{np.median(of):.2f}" for of in lengths.values()])
    yield _row("another shape reported, %", [_others(shapes) for shapes in stated.values()])
    yield _row("the same, speckle 1.5 times the stated, %", [_others(shapes) for shapes in larger.values()])
    yield _row("largest error there, %", [_largest(shapes, at) for at, shapes in larger.items()])


def _row(name: str, cells: Sequence[str]) -> str:
    return f"| {name} | " + " | ".join(cells) + " |"


def _lengths(shapes: Sequence[Shape], at: float) -> np.ndarray:
    low, high = flat_interval(at)
    return np.array([(s.closest_interval_mm[1] - s.closest_interval_mm[0]) / (high - low) for s in shapes])


@cache
def flat_interval(at: float) -> tuple[float, float]:
    """95 % interval of a flat at `at`, if it is known to be one."""
    fit = fit_polynomial(seen(X, flat(at)(X)), 0)
    assert fit is not None
    return interval_mm(at, fit.closest((float(X[0]), float(X[-1]))).sigma_mm)


def _others(shapes: Sequence[Shape]) -> str:
    return f"{100 * share(list(shapes), lambda s: s.kind != 'flat'):.1f}"


def _largest(shapes: Sequence[Shape], at: float) -> str:
    return f"{100 * max(abs(s.closest_mm / at - 1.0) for s in shapes):.1f}"


def others_coverage(closest_mm: Sequence[int] = CLOSEST_MM, n: int = 4 * READINGS) -> tuple[float, int]:
    """Coverage of the intervals of flats that are reported as another shape, and their number."""
    held = [
        holds(shape, at)
        for at in closest_mm
        for shape in readings(flat(at), n, SEED + at)
        if shape.kind != "flat"
    ]
    return float(np.mean(held)), len(held)


def _head(closest_mm: Sequence[int]) -> Iterator[str]:
    yield "| | " + " | ".join(str(at) for at in closest_mm) + " |"
    yield "|---" * (len(closest_mm) + 1) + "|"


def main() -> int:
    """Run, print, write."""
    exact = Simulation(readings)
    calibrated = Simulation(DrawnSensors(DRAWN_SENSORS, SEED).readings)
    covered, others = others_coverage()
    lines = [
        f"seed {SEED} + mm, {READINGS} readings each",
        f"Lasers at {', '.join(f'{x:g}' for x in X)} mm, f = {F_PX:g} px, spots of {SD_PX} px;",
        "columns: distance of the closest point, mm.",
        "",
        "Calibration exact: right shape / 95 % interval with the closest range, %",
        *shape_table(exact),
        "",
        f"Calibration with the stated errors, {DRAWN_SENSORS} sensors: the same",
        *shape_table(calibrated),
        "",
        "Angle, calibration exact: 95 % interval with the angle, % / mean error, deg",
        *angle_table(exact),
        "",
        "Angle, calibration with the stated errors: the same",
        *angle_table(calibrated),
        "",
        "Flats, calibration exact",
        *flat_table(),
        "",
        f"flats reported as another shape: {others}, of these {100 * covered:.0f} % in the interval",
        f"{DRAWN_SHAPES} shapes drawn from the prior:"
        f" {100 * drawn_coverage(DRAWN_SHAPES, SEED):.1f} % in the interval",
    ]
    store("shapes", "Shapes", "python -m tests.proofs.shapes", lines)
    return 0


if __name__ == "__main__":
    sys.exit(main())
