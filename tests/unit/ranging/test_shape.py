"""Shapes through the ranges of one line of lasers: exact where those are exact, honest where they are not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tests.support.statistics import spread
from tests.support.surfaces import (
    F_PX,
    SD_PX,
    Surface,
    X,
    cubic,
    cylinder,
    drawn,
    flat,
    holds,
    incline,
    parabola,
    readings,
    seen,
    share,
)
from workbench.ranging.points import Points, interval_mm
from workbench.ranging.shape import DEFAULT_PRIOR, fit_shape

SEEDS = (1, 2, 3)


@pytest.mark.parametrize(
    ("surface", "kind", "degree", "closest"),
    [
        (flat(500.0), "flat", 0, 500.0),
        (incline(500.0, 30.0), "incline", 1, 500.0),
        (incline(300.0, 60.0), "incline", 1, 300.0),
        (parabola(400.0), "round", 2, 400.0),
        (cubic(300.0), "round", 3, 300.0),
        (cylinder(300.0, 25.0), "cylinder", None, 300.0),
    ],
)
def test_exact_points_tell_the_shape(surface: Surface, kind: str, degree: int | None, closest: float) -> None:
    shape = fit_shape(seen(X, surface(X)))
    assert (shape.kind, shape.degree) == (kind, degree)
    assert shape.closest_mm == pytest.approx(closest, abs=0.3 * shape.closest_sigma_mm)
    assert shape.coefficients == pytest.approx(
        np.polynomial.polynomial.polyfit(X, surface(X), 3)[: len(shape.coefficients)], abs=1e-6
    )


@pytest.mark.parametrize("angle_deg", [-60.0, -20.0, 20.0, 60.0])
def test_the_angle_of_an_incline(angle_deg: float) -> None:
    shape = fit_shape(seen(X, 500.0 + np.tan(np.radians(angle_deg)) * X))
    assert shape.angle_rad == pytest.approx(np.radians(angle_deg))
    assert shape.closest_x_mm == (X[0] if angle_deg > 0 else X[-1])


@pytest.mark.long_cases
@pytest.mark.parametrize("range_mm", [200.0, 1000.0, 4000.0])
def test_at_most_one_of_a_hundred_flats_is_reported_as_another_shape(range_mm: float) -> None:
    shapes = [s for seed in SEEDS for s in readings(flat(range_mm), 1500, seed)]
    assert share(shapes, lambda s: s.kind != "flat") < 0.01


def test_the_interval_of_a_flat_that_is_reported_as_another_shape_includes_it() -> None:
    shapes = [s for seed in SEEDS for s in readings(flat(4000.0), 3000, seed, noise_scale=1.22)]
    others = [s for s in shapes if s.kind != "flat"]
    assert 20 < len(others) < 0.03 * len(shapes)
    assert share(others, lambda s: holds(s, 4000.0)) > 0.9 - spread(0.9, len(others))


@pytest.mark.long_cases
@pytest.mark.parametrize("range_mm", [200.0, 1000.0, 4000.0, 8000.0])
def test_the_closest_range_of_a_flat_is_covered(range_mm: float) -> None:
    shapes = [s for seed in SEEDS for s in readings(flat(range_mm), 1000, seed)]
    assert share(shapes, lambda s: holds(s, range_mm)) > 0.93 - spread(0.93, len(shapes))


@pytest.mark.parametrize(
    ("surface", "at"),
    [(incline, 2000.0), (parabola, 2000.0), (cubic, 1500.0), (cylinder, 1500.0), (cylinder, 2000.0)],
)
def test_the_interval_includes_the_closest_point_of_shapes_that_noise_hides(
    surface: Callable[..., Surface], at: float
) -> None:
    """A flat is reported where it is not clearly wrong; the interval is that of all shapes."""
    hidden = surface(at, 15.0) if surface is incline else surface(at)
    shapes = [s for seed in SEEDS for s in readings(hidden, 300, seed)]
    assert share(shapes, lambda s: holds(s, at)) > 0.89 - spread(0.89, len(shapes))


@pytest.mark.parametrize("seed", SEEDS)
def test_the_interval_covers_95_percent_of_the_shapes_of_the_prior(seed: int) -> None:
    rng = np.random.default_rng(seed)
    held = []
    for at in np.geomspace(150.0, 4500.0, 600).tolist():
        noise = rng.normal(0.0, SD_PX, len(X)) / (F_PX * np.abs(X))
        surface = drawn(DEFAULT_PRIOR, at, rng)
        held.append(holds(fit_shape(seen(X, 1.0 / (1.0 / surface(X) + noise))), at))
    assert np.mean(held) == pytest.approx(0.95, abs=spread(0.95, len(held)))


@pytest.mark.parametrize("angle_deg", [0.0, 5.0, 30.0, 60.0])
@pytest.mark.parametrize("range_mm", [300.0, 3000.0])
def test_the_angle_of_the_incline_fit_is_in_every_answer_and_covered(
    angle_deg: float, range_mm: float
) -> None:
    shapes = [s for seed in SEEDS for s in readings(incline(range_mm, angle_deg), 400, seed)]
    intervals = [s.angle_interval_rad for s in shapes if s.angle_interval_rad is not None]
    assert len(intervals) == len(shapes)
    held = np.mean([low <= np.radians(angle_deg) <= high for low, high in intervals])
    assert held == pytest.approx(0.95, abs=spread(0.95, len(shapes)))


@pytest.mark.parametrize("surface", [flat(300.0), incline(4000.0, 30.0), parabola(2000.0), cylinder(300.0)])
def test_probabilities_of_the_kinds_sum_to_1(surface: Surface) -> None:
    shape = fit_shape(seen(X, surface(X)))
    assert set(shape.probabilities) == {"flat", "incline", "round", "cylinder"}
    assert sum(shape.probabilities.values()) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("range_mm", "angle_deg"), [(200.0, 30.0), (1000.0, 30.0), (500.0, 60.0), (2000.0, 60.0)]
)
def test_inclines_are_told_and_covered(range_mm: float, angle_deg: float) -> None:
    shapes = [s for seed in SEEDS for s in readings(incline(range_mm, angle_deg), 1000, seed)]
    inclines = [s for s in shapes if s.kind == "incline"]
    assert len(inclines) > 0.97 * len(shapes)
    bound = spread(0.95, len(inclines))
    assert share(shapes, lambda s: holds(s, range_mm)) == pytest.approx(0.95, abs=bound + 0.01)
    z = [
        (s.angle_rad - np.radians(angle_deg)) / s.angle_sigma_rad for s in inclines if s.angle_rad is not None
    ]
    assert np.mean(np.abs(z) < 1.96) == pytest.approx(0.95, abs=bound)


@pytest.mark.parametrize(
    ("surface", "kind", "degree"),
    [
        (parabola(500.0), "round", 2),
        (cubic(500.0), "round", 3),
        (cylinder(250.0, 20.0), "cylinder", None),
    ],
)
def test_near_rounds_are_told(surface: Surface, kind: str, degree: int | None) -> None:
    shapes = [s for seed in SEEDS for s in readings(surface, 300, seed)]
    assert share(shapes, lambda s: (s.kind, s.degree) == (kind, degree)) > 0.95


@pytest.mark.parametrize("range_mm", [125.0, 300.0, 600.0])
def test_a_cylinder_on_the_axis_of_symmetric_lasers_is_a_parabola_as_well(range_mm: float) -> None:
    """Four lasers at two distances from the axis: circle and parabola both pass; the interval spans both."""
    shapes = [s for seed in SEEDS for s in readings(cylinder(range_mm), 300, seed)]
    both = [s for s in shapes if s.kind == "round" and s.cylinder is not None]
    assert len(both) > 0.95 * len(shapes)
    assert share(both, lambda s: holds(s, range_mm)) > 0.92 - spread(0.92, len(both))
    radius = [(s.cylinder.radius_mm - 89.0) / s.cylinder.radius_sigma_mm for s in both if s.cylinder]
    assert np.mean(np.abs(radius) < 1.96) == pytest.approx(0.95, abs=spread(0.95, len(both)) + 0.02)


def test_an_error_common_to_all_lasers_bends_nothing() -> None:
    """2 mm in every range: a flat stays one, and its range is known no better than that."""
    r = np.array([500.1, 499.9, 500.1, 499.9])
    alone = fit_shape(Points(X, r, 0.01 * np.eye(4)))
    shared = fit_shape(Points(X, r, 0.01 * np.eye(4) + 4.0))
    assert (alone.kind, shared.kind) == ("flat", "flat")
    assert shared.tried[0].chi2 == pytest.approx(alone.tried[0].chi2, rel=1e-2)
    assert shared.closest_sigma_mm == pytest.approx(np.hypot(2.0, alone.closest_sigma_mm), rel=1e-2)


def test_errors_of_the_places_count_by_the_slope() -> None:
    """At 45 degrees a place wrong by 1 mm is a range wrong by 1 mm; on a flat it is nothing."""
    steep, none = X + 700.0, np.full(4, 700.0)
    exact, loose = 0.25 * np.eye(4), np.eye(4)
    sigma = [
        fit_shape(Points(X, r, exact, x_covariance_mm2=places)).closest_sigma_mm
        for r, places in ((steep, None), (steep, loose), (none, None), (none, loose))
    ]
    assert sigma[1] == pytest.approx(sigma[0] * np.sqrt(1.25 / 0.25), rel=0.01)
    assert sigma[3] == pytest.approx(sigma[2])
    # A place that errs together with its range, along the surface, is no error at all.
    sliding = fit_shape(Points(X, steep, 2 * np.eye(4), 0.0, 2 * np.eye(4), 1.999 * np.eye(4)))
    assert sliding.closest_sigma_mm < 0.1


@pytest.mark.parametrize(
    "surface", [flat(500.0), incline(500.0, 40.0), parabola(400.0), cylinder(300.0, 20.0)]
)
def test_derivatives_of_the_closest_range(surface: Surface) -> None:
    """By differences; and with the covariance of the ranges they give its sigma, other shapes aside."""
    points = seen(X, surface(X))
    shape = fit_shape(points)
    for n, step in enumerate(1e-4 * np.eye(4)):
        ahead, back = (
            fit_shape(Points(X, points.range_mm + sign * step, points.covariance_mm2)).closest_mm
            for sign in (1, -1)
        )
        assert shape.closest_by_range[n] == pytest.approx((ahead - back) / 2e-4, abs=0.05)
    variance = shape.closest_by_range @ points.covariance_mm2 @ shape.closest_by_range
    assert shape.closest_sigma_mm == pytest.approx(np.sqrt(variance), rel=0.05)


@pytest.mark.parametrize(
    ("count", "tried"),
    [
        (1, ()),
        (2, ("degree 0", "degree 1")),
        (3, ("degree 0", "degree 1", "degree 2", "cylinder")),
        (4, ("degree 0", "degree 1", "degree 2", "degree 3", "cylinder")),
    ],
)
def test_shapes_with_as_many_parameters_as_spots_are_tried(count: int, tried: tuple[str, ...]) -> None:
    """A circle has three parameters."""
    x = X[:count]
    assert tuple(test.name for test in fit_shape(seen(x, cylinder(150.0, -20.0)(x))).tried) == tried


def test_three_two_and_one_laser() -> None:
    three = fit_shape(seen(X[:3], incline(500.0, 45.0)(X[:3])))
    assert (three.kind, three.tried[1].freedom) == ("incline", 1)
    bent = fit_shape(seen(X[1:], parabola(300.0)(X[1:])))
    assert (bent.kind, bent.degree, bent.probability) == ("round", 2, None)
    two = fit_shape(seen(X[:2], incline(500.0, 45.0)(X[:2])))
    assert (two.kind, two.probability) == ("incline", None)
    one = fit_shape(seen(X[:1], np.array([500.0])))
    assert (one.kind, one.closest_mm, one.angle_rad) == ("unknown", 500.0, None)
    assert one.closest_interval_mm == pytest.approx(interval_mm(500.0, one.closest_sigma_mm))


def test_one_spot_of_a_wider_front_leaves_room_for_what_lies_before_it() -> None:
    one = fit_shape(seen(X[:1], np.array([500.0])), front_mm=(-60.0, 60.0), lasers=4)
    _, high = interval_mm(500.0, one.closest_sigma_mm)
    assert (one.kind, one.closest_mm) == ("unknown", 500.0)
    assert one.closest_interval_mm[0] < 470.0
    assert one.closest_interval_mm[1] == pytest.approx(high)


def test_a_shape_that_reaches_behind_the_sensor_is_unknown() -> None:
    wall = incline(100.0, 60.0)(X)
    shape = fit_shape(seen(X, wall), front_mm=(-240.0, 60.0))
    assert shape.kind == "unknown"
    assert shape.closest_mm == pytest.approx(100.0)


def test_a_shape_of_two_spots_that_reaches_behind_the_sensor_is_unknown() -> None:
    """The incline through the spots does; a flat, which does not, is many deviations off."""
    spots = seen(X[2:], np.array([190.0, 273.0]))
    shape = fit_shape(spots, front_mm=(-60.0, 60.0), lasers=4)
    assert (shape.kind, shape.closest_mm) == ("unknown", 190.0)
    assert shape.closest_interval_mm[0] < 190.0 < shape.closest_interval_mm[1]


def test_the_front_may_be_wider_than_the_lasers() -> None:
    shape = fit_shape(seen(X, incline(500.0, 30.0)(X)), front_mm=(-120.0, 120.0))
    assert shape.closest_mm == pytest.approx(500.0 - 60.0 * np.tan(np.radians(30.0)), abs=0.1)
    assert shape.closest_x_mm == -120.0


@settings(max_examples=200)
@given(
    st.lists(st.floats(30.0, 10_000.0), min_size=1, max_size=6),
    st.floats(1e-4, 0.2),
    st.floats(-25.0, 50.0),
)
@example([55.0, 9371.0, 871.0, 4964.0, 6407.0, 9155.0], 0.125, 0.0)
def test_any_ranges_have_an_answer(ranges: list[float], relative: float, offset: float) -> None:
    r = np.array(ranges)
    x = np.linspace(-60.0, 60.0, len(r)) + 3.0
    shape = fit_shape(Points(x, r, np.diag((relative * r) ** 2), offset))
    assert shape.closest_mm > 0
    assert np.isfinite([shape.closest_mm, shape.closest_sigma_mm]).all()
    nearest, farthest = shape.closest_interval_mm
    assert nearest <= shape.closest_mm <= farthest
