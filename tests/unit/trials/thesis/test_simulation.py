"""Simulated readings of every chain, and the judgement of claims."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.support.thesis_scenes import scene
from workbench.model.errors import BadInputError
from workbench.model.rig import Rig, load_rig
from workbench.trials.thesis import scene as scenes
from workbench.trials.thesis.schema import ChainReadings, Claim, SceneSimulated, SimulatedScene
from workbench.trials.thesis.simulation import claim_rows, combined, readings_csv, simulate

ROOT = Path(__file__).parents[4]


@pytest.fixture(scope="module")
def rig() -> Rig:
    return load_rig(ROOT / "rigs/thesis-simulated.yaml")


def simulated(one: SimulatedScene, thesis: ChainReadings, ours: ChainReadings) -> SceneSimulated:
    set_mm = (100.0, 200.0, 400.0, 800.0)
    return SceneSimulated(scene=one, set_mm=set_mm, true_mm=set_mm, thesis=thesis, ours=ours, noisy=ours)


def readings(
    closest: tuple[float | None, ...] = (100.0, 200.0, 400.0, 800.0),
    shape: tuple[str, ...] = ("flat",) * 4,
    angle: tuple[float | None, ...] = (None,) * 4,
) -> ChainReadings:
    return ChainReadings(closest_mm=closest, shape=shape, angle_deg=angle)


def test_two_lines_are_averaged() -> None:
    near, far = scenes.Outcome(100.0, "flat"), scenes.Outcome(110.0, "incline", 3.0)
    both = combined([near, far], [640, 480])
    assert both.closest_mm == pytest.approx((100 * 640 + 110 * 480) / 1120)
    assert combined([scenes.Outcome(None, "none"), far], [640, 480]) == far
    assert combined([scenes.Outcome(None, "none")] * 2, [640, 480]).closest_mm is None


@pytest.mark.parametrize(
    ("stated", "error", "kept"),
    [(0.05, 0.0549, True), (0.05, 0.0551, False), (0.002, 0.0024, True), (0.002, 0.0026, False)],
)
def test_an_error_is_held_to_the_digits_stated(stated: float, error: float, kept: bool) -> None:
    one = scene(claims=[Claim(quantity="range", stated=stated)])
    (row,) = claim_rows(simulated(one, readings((100.0, 200 * (1 + error), 400.0, None)), readings()))
    assert row.thesis == pytest.approx(error)
    assert row.reproduced is kept
    assert row.better


def test_two_wrong_shapes_in_a_row_end_the_span() -> None:
    one = scene(claims=[Claim(quantity="shape", stated=400.0)])
    flat, other = "flat", "round 2"
    ours = readings(shape=(flat, other, flat, flat))
    (row,) = claim_rows(simulated(one, readings(shape=(flat, other, other, flat)), ours))
    assert (row.thesis, row.ours) == (100.0, 800.0)
    assert (row.reproduced, row.better) == (False, True)
    (row,) = claim_rows(simulated(one, ours, readings(shape=(other, other, flat, flat))))
    assert (row.ours, row.better) == (0.0, False)


def test_an_incline_is_right_when_its_angle_is() -> None:
    one = scene(incline_deg=30.0, claims=[Claim(quantity="shape"), Claim(quantity="angle")])
    thesis = readings(shape=("incline",) * 3 + ("flat",), angle=(30.0, 37.0, 36.1, None))
    ours = readings(shape=("incline",) * 4, angle=(30.0, 35.9, 24.1, 30.0))
    shape, angle = claim_rows(simulated(one, thesis, ours))
    assert (shape.thesis, shape.ours) == (100.0, 800.0)
    assert angle.thesis == pytest.approx(1.0)
    assert angle.ours == pytest.approx(5.9 / 30)


def test_ranges_of_nothing_are_counted() -> None:
    one = scene(lost=(1, 2, 3, 4), claims=[Claim(quantity="readings", stated=0.0)])
    nothing = readings((None,) * 4, ("none",) * 4)
    (row,) = claim_rows(simulated(one, readings((None, None, 400.0, None)), nothing))
    assert (row.thesis, row.ours, row.reproduced, row.better) == (1.0, 0.0, False, True)


def test_a_simulation_is_the_same_again(rig: Rig) -> None:
    one = scene(lines=("horizontal", "vertical"))
    first, second = (simulate(one, rig, 3, np.random.default_rng(5)) for _ in range(2))
    assert first == second
    lines = readings_csv([first]).splitlines()
    assert len(lines) == 1 + 3
    assert lines[0].startswith("scene,set_mm,true_mm,thesis_closest_mm")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"lost": (5,)}, "expected numbers from 1 to 4, got 5"),
        ({"incline_deg": 30.0, "coefficients": (1.0,)}, "incline_deg or coefficients, got both"),
        ({"set_mm": (500.0, 100.0)}, "nearest < farthest"),
        ({"lines": ("vertical", "vertical")}, "lines: "),
    ],
)
def test_scenes_that_make_no_sense(rig: Rig, changes: dict[str, object], message: str) -> None:
    with pytest.raises((BadInputError, ValueError), match=message):
        simulate(scene(**changes), rig, 2, np.random.default_rng(1))
