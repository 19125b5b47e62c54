"""`python -m tests.proofs.shapes`: how often the ranger tells the right shape, and holds its closest point.

Some seconds; the table goes to docs/benchmarks and from there to docs/ranging.md, where a test reads it.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from functools import partial

from tests.proofs.tables import keep
from tests.support.surfaces import (
    F_PX,
    SD_PX,
    Surface,
    X,
    cubic,
    cylinder,
    flat,
    holds,
    incline,
    parabola,
    readings,
    share,
)
from workbench.ranging.shape import Shape

READINGS, SEED = 1000, 2001
CLOSEST_MM = (150, 300, 600, 1000, 1500, 2000, 3000, 4500)


def _is(*kinds: str) -> Callable[[Shape], bool]:
    return lambda shape: shape.kind in kinds


ROWS: dict[str, tuple[Callable[[float], Surface], Callable[[Shape], bool]]] = {
    "flat": (flat, _is("flat")),
    **{
        f"incline {angle} deg": (partial(incline, angle_deg=angle), _is("incline"))
        for angle in (5, 15, 30, 60)
    },
    "parabola 0.02 x^2": (parabola, _is("round")),
    "cubic 0.0003 (x + 60)^3": (cubic, lambda shape: shape.degree == 3),
    "cylinder, radius 89, axis at 20: cylinder": (lambda r: cylinder(r, 20.0), _is("cylinder")),
    "the same: cylinder or round": (lambda r: cylinder(r, 20.0), _is("cylinder", "round")),
    "cylinder on the axis: round": (cylinder, _is("round")),
}


def table(closest_mm: Sequence[int] = CLOSEST_MM) -> Iterator[str]:
    """The rows as Markdown: right shape / interval that holds, % of the readings."""
    yield "| | " + " | ".join(str(at) for at in closest_mm) + " |"
    yield "|---" * (len(closest_mm) + 1) + "|"
    for name, (surface, is_right) in ROWS.items():
        yield f"| {name} | " + " | ".join(_cell(surface, is_right, float(at)) for at in closest_mm) + " |"


def _cell(surface: Callable[[float], Surface], is_right: Callable[[Shape], bool], closest_mm: float) -> str:
    shapes = readings(
        surface(closest_mm), READINGS, SEED + int(closest_mm)
    )  # noise of its own in each column
    told, held = share(shapes, is_right), share(shapes, lambda shape: holds(shape, closest_mm))
    return f"{100 * told:.0f}/{100 * held:.0f}"


def main() -> int:
    """Run, print, write."""
    lines = [
        f"seed {SEED} + mm, {READINGS} readings each",
        f"Lasers at {', '.join(f'{x:g}' for x in X)} mm, f = {F_PX:g} px, spots of {SD_PX} px,",
        "calibration exact.",
        "How often the right shape is told / the 95 % interval of the closest range holds it, %;",
        "columns: distance of the closest point, mm.",
        "",
        *table(),
    ]
    keep("shapes", "Shapes", lines)
    return 0


if __name__ == "__main__":
    sys.exit(main())
