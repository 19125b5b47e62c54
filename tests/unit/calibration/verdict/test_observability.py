"""Null directions: exact ones of the pinhole by hand, their names, and what they do to ranges."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest

from tests.support.message_text import numbers
from tests.support.rigs import PROVENANCE, World, prior, thesis_rig
from workbench.calibration.estimation.fit import CalibrationFit, data_share, fit
from workbench.calibration.estimation.problem import LeastSquaresProblem
from workbench.calibration.model.layout import Layout
from workbench.calibration.model.prediction import SpotData, predict_spots
from workbench.calibration.verdict.export import calibrate
from workbench.calibration.verdict.null_direction_text import (
    APART,
    BASELINE,
    BOARD,
    NO_EFFECT,
    REMEDIES,
    SQUARE,
)
from workbench.calibration.verdict.observability import (
    NullDirection,
    direction_lines,
    information_of,
)
from workbench.model.acceptance import Acceptance
from workbench.model.nested import fix_parameters
from workbench.model.rig import Rig

SEEDS = (1, 2, 3)


def directions_of(fitted: CalibrationFit) -> tuple[NullDirection, ...]:
    return calibrate(fitted, Acceptance(), PROVENANCE)[1].directions


def pinhole() -> Rig:
    return fix_parameters(thesis_rig(), ("k1", "k2"))


def by_first(directions: tuple[NullDirection, ...]) -> dict[str, NullDirection]:
    return {next(iter(one.change)): one for one in directions}


@pytest.fixture(scope="module", params=SEEDS)
def fitted(request: pytest.FixtureRequest) -> CalibrationFit:
    return fit(pinhole(), World(pinhole(), request.param).observations())


def test_a_pinhole_leaves_open_what_algebra_says(fitted: CalibrationFit) -> None:
    """u = cx + f (b / z + t): f with b, cx with all t, cy likewise, the ruler with f or b; nothing else.

    A plane that pitches keeps its depth where y = 0, which is where all spots are.
    """
    found = by_first(directions_of(fitted))
    assert set(found) == {"ruler_scale", "f_px", "cx_px", "cy_px", "target_slope_y"}
    assert set(found["target_slope_y"].change) == {"target_slope_y"}
    f = fitted.values[0]
    of_f = found["f_px"].change
    assert set(of_f) == {"f_px", "L1.x_mm", "L2.x_mm", "L3.x_mm", "L4.x_mm"}
    names = [p.name for p in fitted.table.parameters]
    for name in list(of_f)[1:]:
        value = fitted.values[names.index(name)]
        assert of_f[name] / value == pytest.approx(-of_f["f_px"] / f, rel=0.05)
    for first, pointing in (("cx_px", "tx"), ("cy_px", "ty")):
        change = found[first].change
        assert set(change) == {first, *(f"L{i}.{pointing}" for i in (1, 2, 3, 4))}
        for i in (1, 2, 3, 4):
            assert change[f"L{i}.{pointing}"] == pytest.approx(-change[first] / f, rel=0.05)


@pytest.mark.long_cases
def test_a_named_direction_shows_in_no_spot(fitted: CalibrationFit) -> None:
    """By the model itself, not by its derivatives: all spots move by far less than one sd in all."""
    cells = fitted.cells
    layout = Layout("plumb_bob", 4, len(cells.placements))
    spots = SpotData(cells.laser, cells.placement, cells.time, cells.parts)
    standoffs = jnp.array([p.standoff_mm for p in cells.placements])
    names = [p.name for p in fitted.table.parameters]

    def moved_sd(change: dict[str, float]) -> float:
        moved = fitted.values.copy()
        for name, step in change.items():
            moved[names.index(name)] += step
        here, there = (
            np.asarray(predict_spots(jnp.asarray(values), layout, spots, standoffs))
            for values in (fitted.values, moved)
        )
        return float(np.linalg.norm((there - here) / cells.sd_px))

    for one in directions_of(fitted):
        first = next(iter(one.change))
        alone = moved_sd({first: one.change[first]})
        if len(one.change) == 1:
            assert alone < 0.5
        elif first != "ruler_scale":  # which the error of the placements hides as well
            assert alone > 10
        assert moved_sd(one.change) < max(0.5, 0.1 * alone)


def test_ranges_are_hurt_where_a_direction_moves_them(fitted: CalibrationFit) -> None:
    found = by_first(directions_of(fitted))
    for name in ("f_px", "cx_px", "cy_px"):
        assert not found[name].hurts_ranges
        assert found[name].relative_range_change < 1e-4
    # A ruler that is wrong by 0.05 % makes every range wrong by 0.05 %.
    assert found["ruler_scale"].relative_range_change == pytest.approx(0.0005, rel=0.02)
    assert found["ruler_scale"].hurts_ranges
    assert found["ruler_scale"].remedy in found["ruler_scale"].line
    assert numbers(found["ruler_scale"].line)[-1] == pytest.approx(0.05, rel=0.02)


def test_words_and_remedies(fitted: CalibrationFit) -> None:
    found = by_first(directions_of(fitted))
    assert all(one.change[name] > 0 for name, one in found.items()), "the first parameter grows"
    of_f = found["f_px"]
    percent = 100 * of_f.change["f_px"] / fitted.values[0]
    assert numbers(of_f.words) == pytest.approx([percent, -percent], rel=0.05)
    assert of_f.remedy == " or ".join([*REMEDIES[BASELINE], *REMEDIES["f_px"]])
    for name in ("cx_px", "cy_px"):
        px, mrad = numbers(found[name].words)
        assert px == pytest.approx(found[name].change[name], rel=0.05)
        assert mrad == pytest.approx(-1000 * px / fitted.values[0], rel=0.05)
    assert (found["ruler_scale"].remedy,) == REMEDIES["ruler_scale"]


@pytest.mark.parametrize("seed", SEEDS)
def test_a_common_tilt_trades_with_image_centre_and_pointing_where_the_lens_bends(seed: int) -> None:
    """k1 (t + b / z)^3 grows by 3 k1 t (b / z)^2 with a shift of the centre: as by a slope over (b / z)^2."""
    found = by_first(directions_of(fit(thesis_rig(), World(thesis_rig(), seed).observations())))
    tilt = found["target_slope_x"]
    assert set(tilt.change) == {"target_slope_x", "cx_px", *(f"L{i}.tx" for i in (1, 2, 3, 4))}
    assert tilt.hurts_ranges
    # The nearest ranges, of lasers 60 mm off the axis: the slope over b / z, and what goes with it.
    assert tilt.relative_range_change > 0.2 * tilt.change["target_slope_x"]
    assert {SQUARE, BOARD} == set(tilt.remedy.split(" or "))
    assert not found["target_slope_y"].hurts_ranges


def test_a_measured_common_tilt_is_no_null_direction() -> None:
    bench = thesis_rig().bench.model_copy(update={"target_tilt_sd_deg": 0.0})
    rig = thesis_rig().model_copy(update={"bench": bench})
    found = directions_of(fit(rig, World(rig, 1).observations()))
    assert not any("target_slope_x" in one.change for one in found)


def test_a_baseline_known_exactly_resolves_f() -> None:
    rig = fix_parameters(pinhole(), ("L1.x_mm",))
    found = by_first(directions_of(fit(rig, World(rig, 1).observations())))
    # Only the ruler's scale is left to trade with it.
    assert "f_px" not in found
    assert "f_px" in found["ruler_scale"].change


def test_lasers_that_are_each_open_by_themselves_are_one_line() -> None:
    rig = pinhole()
    found = directions_of(fit(rig, World(rig, 1).observations((2000.0, 2500.0, 3000.0))))
    (one,) = [d for d in found if "L1.x_mm" in d.change and len(d.lasers) > 1]
    assert one.lasers == ("L1", "L2", "L3", "L4")
    assert one.remedy == APART
    for i in (1, 2, 3, 4):
        # b / z + t stays what it is at some depth among the three.
        depth_mm = -one.change[f"L{i}.x_mm"] / one.change[f"L{i}.tx"]
        assert 2000 < depth_mm < 3000


def test_a_laser_above_has_its_baseline_along_v() -> None:
    lasers = thesis_rig().lasers
    turned = tuple(
        laser.model_copy(update={"axis": "v", "x_mm": prior(0.0, 0.2), "y_mm": laser.x_mm})
        for laser in lasers[2:]
    )
    rig = pinhole().model_copy(update={"lasers": turned})
    found = by_first(directions_of(fit(rig, World(rig, 1).observations())))
    assert set(found["f_px"].change) == {"f_px", "L3.y_mm", "L4.y_mm"}
    assert REMEDIES[BASELINE][0] in found["f_px"].remedy


def test_what_no_spot_shows_stands_alone() -> None:
    rig = pinhole().model_copy(
        update={"camera": pinhole().camera.model_copy(update={"k3": prior(0.0, 1e-3)})}
    )
    found = by_first(directions_of(fit(rig, World(rig, 1).observations((1000.0, 2000.0, 4000.0)))))
    assert found["k3"].change.keys() == {"k3"}
    assert found["k3"].remedy == NO_EFFECT
    assert not any("k3" in line for line in direction_lines(tuple(found.values())))


def test_the_reader_is_not_drowned() -> None:
    rig = thesis_rig()
    found = directions_of(fit(rig, World(rig, 1).observations((300.0, 301.0, 302.0))))
    lines = direction_lines(found)
    assert len(found) > 5
    assert len(lines) == 5
    several = [one for one in found if len(one.change) > 1]
    assert lines[:4] == [one.line for one in several[:4]]
    assert numbers(lines[-1]) == [len(several) - 4]
    changes = [one.relative_range_change for one in found]
    assert changes == sorted(changes, reverse=True)


def test_information_is_that_of_the_data_alone() -> None:
    """Against the normal equations with the placements eliminated, and the share that they give."""
    world = World(thesis_rig(), 1)
    fitted = fit(world.rig, world.observations())
    free = fitted.table.free[fitted.table.is_sensor[fitted.table.free]]
    sd = fitted.table.prior_sd[free]
    scaled = fitted.covariance[np.ix_(free, free)] / np.outer(sd, sd)
    problem = LeastSquaresProblem.of(world.rig, fitted.table, fitted.cells, ())
    jacobian = problem.solve(fitted.noise_scale).jacobian
    ours, theirs = jacobian[:, free], jacobian[:, ~fitted.table.is_sensor]
    noise = np.eye(len(jacobian)) + theirs @ theirs.T
    np.testing.assert_allclose(
        information_of(scaled), ours.T @ np.linalg.solve(noise, ours), rtol=1e-6, atol=1e-4
    )
    assert data_share(jacobian, fitted.table)[free] == pytest.approx(fitted.data_share[free])


def test_a_rig_of_constants_has_none() -> None:
    rig = thesis_rig()
    everything = [
        p.name for p in fit(rig, World(rig, 1).observations()).table.parameters if p.kind == "sensor"
    ]
    fixed = fix_parameters(rig, everything)
    assert directions_of(fit(fixed, World(fixed, 1).observations())) == ()
