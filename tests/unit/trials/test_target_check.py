"""Targets that are not those asked for, named from the readings of drawn sensors."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.rangers import thesis_ranger
from tests.support.rigs import thesis_rig
from tests.support.simulated_trials import SimulatedBench
from workbench.model.target import CylinderTarget, FlatTarget, Placement, PolynomialTarget, TargetShape
from workbench.trials.target_check import Points, fit_plane, other_target

FLAT = FlatTarget()
RIGHT_AWAY = FlatTarget(yaw_deg=30.0, turn_sd_deg=0.1)
LEFT_AWAY = FlatTarget(yaw_deg=-30.0, turn_sd_deg=0.1)
CYLINDER = CylinderTarget(diameter_mm=178.0, diameter_sd_mm=0.1)
TARGETS: tuple[TargetShape, ...] = (FLAT, RIGHT_AWAY, LEFT_AWAY, CYLINDER)


def placement(target: TargetShape, standoff_mm: float) -> Placement:
    return Placement(key="t.1/1", standoff_mm=standoff_mm, target=target)


def found(seed: int, present: TargetShape, asked: TargetShape, standoff_mm: float) -> str:
    bench = SimulatedBench.draw(thesis_ranger(), thesis_rig(), seed)
    readings = [taken for taken, _ in bench.readings("t.1", placement(present, standoff_mm), 3)]
    return other_target(thesis_ranger().sensor, readings, placement(asked, standoff_mm), bench.rig.bench)


@pytest.mark.parametrize("standoff_mm", [150.0, 600.0])
@pytest.mark.parametrize("asked", TARGETS)
@pytest.mark.parametrize("present", TARGETS)
def test_any_other_target_is_named(present: TargetShape, asked: TargetShape, standoff_mm: float) -> None:
    for seed in range(4):
        assert bool(found(seed, present, asked, standoff_mm)) == (present != asked)


@pytest.mark.parametrize("standoff_mm", [300.0, 2000.0, 4000.0])
@pytest.mark.parametrize("target", TARGETS)
def test_the_target_asked_for_raises_no_alarm(target: TargetShape, standoff_mm: float) -> None:
    """The probability of an alarm is 1e-4 each; none of some hundred."""
    assert [found(seed, target, target, standoff_mm) for seed in range(10)] == [""] * 10


def test_the_angle_of_a_plane_is_measured() -> None:
    z = []
    for seed in range(30):
        bench = SimulatedBench.draw(thesis_ranger(), thesis_rig(), seed)
        exact = bench.rig.bench.model_copy(update={"tilt_sd_deg": 0.0, "target_tilt_sd_deg": 0.0})
        still = SimulatedBench.draw(thesis_ranger(), bench.rig.model_copy(update={"bench": exact}), seed)
        target = FlatTarget(yaw_deg=40.0)
        points = Points.of(
            thesis_ranger().sensor,
            [taken for taken, _ in still.readings("t.1", placement(target, 500.0), 5)],
        )
        assert points is not None
        plane = fit_plane(points)
        z.append((plane.angles_deg[0] - 40.0) / plane.sd_deg[0])
        assert plane.angles_deg[1] == plane.sd_deg[1] == 0.0
    # The relative standard deviation of a variance of 30 is 26 %.
    assert np.square(z).mean() == pytest.approx(1.0, abs=4 * 0.26)
    assert np.mean(z) == pytest.approx(0.0, abs=4 / np.sqrt(30))


def test_a_measured_tilt_of_the_rail_belongs_to_the_target_asked_for() -> None:
    rig = thesis_rig()
    tilted = rig.model_copy(update={"bench": rig.bench.model_copy(update={"target_yaw_deg": 8.0})})
    bench = SimulatedBench.draw(thesis_ranger(), tilted, 1)
    readings = [taken for taken, _ in bench.readings("t.1", placement(FLAT, 300.0), 3)]
    sensor = thesis_ranger().sensor
    assert other_target(sensor, readings, placement(FLAT, 300.0), tilted.bench) == ""
    assert "vertical" in other_target(sensor, readings, placement(FLAT, 300.0), rig.bench)


def test_without_two_lasers_nothing_is_named() -> None:
    bench = SimulatedBench.draw(thesis_ranger(), thesis_rig(), 1)
    readings = [taken for taken, _ in bench.readings("t.1", placement(RIGHT_AWAY, 300.0), 1)]
    single = [one.model_copy(update={"lasers": one.lasers[:1]}) for one in readings]
    sensor = thesis_ranger().sensor
    assert other_target(sensor, single, placement(FLAT, 300.0), bench.rig.bench) == ""
    assert other_target(sensor, [], placement(FLAT, 300.0), bench.rig.bench) == ""


def test_a_surface_without_a_model_is_not_compared() -> None:
    bench = SimulatedBench.draw(thesis_ranger(), thesis_rig(), 1)
    readings = [taken for taken, _ in bench.readings("t.1", placement(RIGHT_AWAY, 300.0), 1)]
    asked = placement(PolynomialTarget(coefficients=(0.0, 0.01)), 300.0)
    assert other_target(thesis_ranger().sensor, readings, asked, bench.rig.bench) == ""
