"""Charts of the thesis's simulation."""

from __future__ import annotations

import pytest

from workbench.trials.thesis.figures import ERROR_FIGURES, figures
from workbench.trials.thesis.schema import ChainReadings, SceneSimulated, SimulatedScene

NAMES = sorted({name for figure in ERROR_FIGURES for name in figure.scenes})
ANGLE_DEG = 30.0


def simulated(name: str) -> SceneSimulated:
    shape = (
        {"incline_deg": ANGLE_DEG} if "incline" in name else {"coefficients": (0.5, 0.02), "shift_mm": 60.0}
    )
    chain = ChainReadings(closest_mm=(99.0, None, 404.0), shape=("flat",) * 3, angle_deg=(33.0, None, 30.0))
    return SceneSimulated(
        scene=SimulatedScene.model_validate(
            {"name": name, "source": "f", "set_mm": (100.0, 400.0), "claims": [{"quantity": "range"}]} | shape
        ),
        set_mm=(110.0, 210.0, 410.0),
        true_mm=(100.0, 200.0, 400.0),
        thesis=chain,
        ours=chain,
        noisy=chain,
    )


def test_all_scenes_give_all_figures_in_their_order() -> None:
    charts = figures({name: simulated(name) for name in reversed(NAMES)})
    assert [chart.name for chart in charts] == [f"figure-{number}" for number in range(21, 31)]


def test_a_figure_without_its_scenes_is_left_out() -> None:
    assert figures({}) == ()
    assert [chart.name for chart in figures({"incline-30": simulated("incline-30")})] == []
    names = [chart.name for chart in figures({"flat-horizontal": simulated("flat-horizontal")})]
    assert names == ["figure-21", "figure-22"]


def test_errors_have_the_thesis_s_sign_and_percent() -> None:
    by_name = {chart.name: chart for chart in figures({name: simulated(name) for name in NAMES})}
    ranges, angles = by_name["figure-23"], by_name["figure-24"]
    assert ranges.y.unit == angles.y.unit == "%"
    assert ranges.x.limits == (0.0, 5000.0)
    for series in ranges.series:
        assert series.x == (110.0, 210.0, 410.0)
        assert series.y[1] is None
        assert series.y[::2] == pytest.approx((1.0, -1.0))
    for series in angles.series:
        assert series.y[1] is None
        assert series.y[::2] == pytest.approx((-10.0, 0.0))


def test_the_second_scene_is_dashed_and_series_differ_in_name() -> None:
    by_name = {chart.name: chart for chart in figures({name: simulated(name) for name in NAMES})}
    assert [series.dashed for series in by_name["figure-23"].series] == [False, True] * 3
    assert len({series.color for series in by_name["figure-23"].series}) == 3
    assert len({series.name for series in by_name["figure-21"].series}) == 3


def test_a_surface_is_the_scene_s_polynomial() -> None:
    by_name = {chart.name: chart for chart in figures({name: simulated(name) for name in NAMES})}
    (surface,) = by_name["figure-25"].series
    at = dict(zip(surface.x, surface.y, strict=True))
    assert at[60.0] == 0.0
    assert at[70.0] == pytest.approx(0.5 * 10 + 0.02 * 100)
