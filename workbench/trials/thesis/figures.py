"""Figures 21 to 30 of the thesis as charts of a simulation, with the curves of the workbench's chain."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from workbench.model.chart import Axis, Chart, Series
from workbench.trials.thesis.schema import ChainReadings, SceneSimulated, SimulatedScene

CHAINS = (("thesis", "#d08010"), ("noisy", "#70a0d8"), ("ours", "#0a2f80"))
"""Name and colour of each chain, in the order of drawing."""
NAMES = {"thesis": "thesis", "noisy": "workbench, noise", "ours": "workbench"}
PERCENT = 100.0
FRONT_MM = range(121)


@dataclass(frozen=True)
class ErrorFigure:
    """Figure of the thesis with errors against distance."""

    number: int
    title: str
    scenes: tuple[str, ...]
    """Names of one or two scenes; the curves of the second are dashed."""
    farthest_mm: float
    limits_percent: tuple[float, float]
    is_angle: bool = False


ERROR_FIGURES = (
    ErrorFigure(21, "flat, horizontal line", ("flat-horizontal",), 5000, (-6, 6)),
    ErrorFigure(22, "flat, close range", ("flat-horizontal",), 2000, (-1.5, 1.5)),
    ErrorFigure(23, "inclines, range", ("incline-30", "incline-60"), 5000, (-6, 6)),
    ErrorFigure(24, "inclines, angle", ("incline-30", "incline-60"), 1000, (-6, 6), is_angle=True),
    ErrorFigure(26, "round, degree 2", ("round-2", "round-2-shifted"), 5000, (-10, 10)),
    ErrorFigure(28, "round, degree 3", ("round-3", "round-3-shifted"), 5000, (-6, 6)),
    ErrorFigure(30, "round, degree 4", ("round-4",), 5000, (-10, 20)),
)
Error = Callable[[SceneSimulated, ChainReadings, int], float | None]
SURFACES = ((25, "round-2-shifted"), (27, "round-3-shifted"), (29, "round-4"))


def figures(simulated: Mapping[str, SceneSimulated]) -> tuple[Chart, ...]:
    """Charts named `figure-21` to `figure-30`, in this order, of all figures whose scenes were simulated.

    Args:
        simulated: simulated scenes by name.
    """
    errors = [
        _error_chart(figure, [simulated[name] for name in figure.scenes])
        for figure in ERROR_FIGURES
        if all(name in simulated for name in figure.scenes)
    ]
    surfaces = [
        _surface_chart(number, simulated[name].scene) for number, name in SURFACES if name in simulated
    ]
    return tuple(sorted([*errors, *surfaces], key=lambda chart: chart.name))


def _error_chart(figure: ErrorFigure, scenes: list[SceneSimulated]) -> Chart:
    value: Error = _angle_error if figure.is_angle else _range_error
    return Chart(
        name=f"figure-{figure.number}",
        title=f"Figure {figure.number}: {figure.title}",
        x=Axis(label="distance set", unit="mm", limits=(0.0, figure.farthest_mm)),
        y=Axis(label="error, (true - measured) / true", unit="%", limits=figure.limits_percent),
        series=tuple(
            Series(
                name=NAMES[chain] if len(scenes) == 1 else f"{NAMES[chain]}, {_difference(one.scene)}",
                x=one.set_mm,
                y=tuple(value(one, getattr(one, chain), i) for i in range(len(one.set_mm))),
                style="line",
                color=color,
                dashed=dashed,
            )
            for chain, color in CHAINS
            for one, dashed in zip(scenes, (False, True), strict=False)
        ),
    )


def _difference(scene: SimulatedScene) -> str:
    """Property that distinguishes a scene from the other one of its figure."""
    return f"{scene.incline_deg:g} deg" if scene.incline_deg else f"shift {scene.shift_mm:g} mm"


def _range_error(one: SceneSimulated, chain: ChainReadings, i: int) -> float | None:
    closest = chain.closest_mm[i]
    return None if closest is None else PERCENT * (one.true_mm[i] - closest) / one.true_mm[i]


def _angle_error(one: SceneSimulated, chain: ChainReadings, i: int) -> float | None:
    angle, true = chain.angle_deg[i], one.scene.incline_deg
    return None if angle is None or not true else PERCENT * (true - angle) / true


def _surface_chart(number: int, scene: SimulatedScene) -> Chart:
    heights = tuple(
        sum(c * (x - scene.shift_mm) ** (k + 1) for k, c in enumerate(scene.coefficients)) for x in FRONT_MM
    )
    x = Axis(label="position along the front", unit="mm", limits=(0.0, float(FRONT_MM[-1])))
    return Chart(
        name=f"figure-{number}",
        title=f"Figure {number}: surface of {scene.name}",
        x=x,
        y=Axis(label="distance beyond the set distance", unit="mm"),
        series=(
            Series(name="surface", x=tuple(map(float, FRONT_MM)), y=heights, style="line", color="#0a2f80"),
        ),
    )
