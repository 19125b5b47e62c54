"""The thesis's figures 21 to 30 from a simulation's records, with the workbench's own curves on them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from workbench.report.line_chart import LineChart, Series
from workbench.trials.thesis.schema import ChainReadings, SceneSimulated, SimulatedScene

CHAINS = (("thesis", "#d08010", 1.2), ("noisy", "#70a0d8", 1.2), ("ours", "#0a2f80", 2.0))
"""Name, colour, width, in the order they are drawn."""
NAMES = {"thesis": "as in the thesis", "noisy": "ours, noise", "ours": "ours"}
DASHES = ("", "6 3")
SIGN = "error, (true - measured) / true"
FRONT_MM = range(121)


@dataclass(frozen=True)
class Figure:
    """One figure of the thesis."""

    number: int
    title: str
    scenes: tuple[str, ...]
    farthest_mm: float
    y_limits: tuple[float, float]
    of_angle: bool = False


FIGURES = (
    Figure(21, "flat, horizontal line", ("flat-horizontal",), 5000, (-0.06, 0.06)),
    Figure(22, "flat, close range", ("flat-horizontal",), 2000, (-0.015, 0.015)),
    Figure(23, "inclines, range", ("incline-30", "incline-60"), 5000, (-0.06, 0.06)),
    Figure(24, "inclines, angle", ("incline-30", "incline-60"), 1000, (-0.06, 0.06), of_angle=True),
    Figure(26, "round, degree 2", ("round-2", "round-2-shifted"), 5000, (-0.1, 0.1)),
    Figure(28, "round, degree 3", ("round-3", "round-3-shifted"), 5000, (-0.06, 0.06)),
    Figure(30, "round, degree 4", ("round-4",), 5000, (-0.1, 0.2)),
)
SURFACES = ((25, "round-2-shifted"), (27, "round-3-shifted"), (29, "round-4"))


def figures(simulated: dict[str, SceneSimulated]) -> dict[str, LineChart]:
    """Charts by file name, of the figures all of whose scenes are there."""
    errors = {
        f"figure-{f.number}": _errors(f, [simulated[name] for name in f.scenes])
        for f in FIGURES
        if all(name in simulated for name in f.scenes)
    }
    surfaces = {
        f"figure-{number}": _surface(number, simulated[name].scene)
        for number, name in SURFACES
        if name in simulated
    }
    return dict(sorted((errors | surfaces).items()))


def _errors(figure: Figure, scenes: list[SceneSimulated]) -> LineChart:
    value = _angle_error if figure.of_angle else _range_error
    return LineChart(
        f"Figure {figure.number}: {figure.title}",
        "distance set (mm)",
        SIGN,
        [
            Series(
                NAMES[chain] if len(scenes) == 1 else f"{NAMES[chain]}, {_difference(one.scene)}",
                _points(one, getattr(one, chain), value),
                color,
                width,
                dash,
            )
            for chain, color, width in CHAINS
            for one, dash in zip(scenes, DASHES, strict=False)
        ],
        (0.0, figure.farthest_mm),
        figure.y_limits,
    )


def _difference(scene: SimulatedScene) -> str:
    """What tells a scene from the other one of its figure."""
    return f"{scene.incline_deg:g} deg" if scene.incline_deg else f"shift {scene.shift_mm:g}"


Value = Callable[[SceneSimulated, ChainReadings, int], float | None]


def _points(one: SceneSimulated, chain: ChainReadings, value: Value) -> list[tuple[float, float | None]]:
    return [(set_mm, value(one, chain, i)) for i, set_mm in enumerate(one.set_mm)]


def _range_error(one: SceneSimulated, chain: ChainReadings, i: int) -> float | None:
    closest = chain.closest_mm[i]
    return None if closest is None else (one.true_mm[i] - closest) / one.true_mm[i]


def _angle_error(one: SceneSimulated, chain: ChainReadings, i: int) -> float | None:
    told, true = chain.angle_deg[i], one.scene.incline_deg
    return None if told is None or not true else (true - told) / true


def _surface(number: int, scene: SimulatedScene) -> LineChart:
    heights = [
        sum(c * (x - scene.shift_mm) ** (k + 1) for k, c in enumerate(scene.coefficients)) for x in FRONT_MM
    ]
    span = max(heights) - min(heights)
    return LineChart(
        f"Figure {number}: surface of {scene.name}",
        "place along the front (mm)",
        "distance beyond the one set (mm)",
        [Series("surface", list(zip(map(float, FRONT_MM), heights, strict=True)), "#0a2f80", 2.0)],
        (0.0, float(FRONT_MM[-1])),
        (min(heights) - 0.05 * span, max(heights) + 0.05 * span),
    )
