"""Noise at the rim of a window, outlying pixels, and the table of accepted spots."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from tests.support.draw import Drawn, draw, profile
from tests.support.spot_models import pixel_noise
from workbench.spots import find_spots
from workbench.spots.fit import Windows, fit_spots
from workbench.spots.kernels.acceptance import (
    COLUMNS,
    FLUX_NOISE_SD,
    FLUX_SD,
    IS_SPOT,
    NEXT_HALF,
    PEAK,
    U_SD,
    U_SPECKLE_SD,
    V_SD,
    V_SPECKLE_SD,
    _fill_row,
    _is_spot,
    _take_floor_from_rim,
    fit_group,
    without_outliers,
)
from workbench.spots.kernels.columns import (
    FLUX,
    FLUX_DEVIATION,
    FLUX_NOISE,
    INFORMATION,
    LN_SU,
    LN_SV,
    PEAK_DN,
    RIM_NOISE,
    RIM_PIXELS,
    SHEAR,
    STATISTIC_COLUMNS,
    U_DEVIATION,
    U_SPECKLE,
    V_DEVIATION,
    V_SPECKLE,
    WORST_EXCESS,
    U,
    V,
)

HALF, WINDOWS = 5, 400
SIDE = 2 * HALF + 1
RIM = 8 * HALF


def windows(used: str, seed: int, sd: float = 1.0) -> Windows:
    """A clear spot in white noise, the rest of the window unusable."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:SIDE, :SIDE] - HALF
    spot = 400.0 * np.exp(-0.5 * (x**2 + y**2) / 1.3**2)
    data = spot + rng.normal(0.0, sd, (WINDOWS, SIDE, SIDE))
    usable = {"all": y < SIDE, "half": x <= 1, "corner": (x <= 2) & (y <= 2)}[used]
    shape = (WINDOWS, SIDE, SIDE)
    return Windows(data, np.broadcast_to(usable, shape).copy(), np.full(shape, np.inf))


@pytest.mark.parametrize(("used", "count"), [("all", 40), ("half", 11 + 2 * 6), ("corner", 15)])
def test_the_noise_at_the_rim_does_not_depend_on_how_much_of_it_is_used(used: str, count: int) -> None:
    win = windows(used, 1)
    start = np.tile([0.0, 4000.0, HALF, HALF, 0.3, 0.3], (WINDOWS, 1))
    statistics = fit_spots(win, start, pixel_noise(1.0, 1e-3, WINDOWS)).statistics
    assert (statistics[:, RIM_PIXELS] == count).all()
    # The mean of `count` squared normal numbers has sd sqrt(2 / count); the fit takes the leverage of six
    # parameters, of which the background's share of the rim is the larger part: 4 % at most.
    assert statistics[:, RIM_NOISE].mean() == pytest.approx(1.0, abs=0.06 + 4 * np.sqrt(2 / count / WINDOWS))


@pytest.mark.parametrize(("count", "reads", "raised"), [(40, 1.9, False), (40, 2.2, True), (20, 2.2, False)])
def test_a_rim_of_fewer_pixels_must_be_noisier_to_count(count: int, reads: float, raised: bool) -> None:
    statistics, floor = np.zeros((1, STATISTIC_COLUMNS)), np.ones(1)
    statistics[0, RIM_NOISE], statistics[0, RIM_PIXELS] = reads, count
    assert _take_floor_from_rim(floor, statistics) == raised
    assert floor[0] == (reads if raised else 1.0)


@pytest.mark.parametrize(
    ("count", "reads", "lowered"), [(40, 0.26, False), (40, 0.22, True), (20, 0.12, False)]
)
def test_a_rim_must_be_much_quieter_to_count(count: int, reads: float, lowered: bool) -> None:
    """As rare as 5 sd of a Gaussian on one side: 2.9e-7."""
    statistics, floor = np.zeros((1, STATISTIC_COLUMNS)), np.ones(1)
    statistics[0, RIM_NOISE], statistics[0, RIM_PIXELS] = reads, count
    assert _take_floor_from_rim(floor, statistics) == lowered
    assert floor[0] == (reads if lowered else 1.0)
    assert (chi2(count).cdf(reads * count) < 2.9e-7) == lowered


@pytest.mark.parametrize("seed", [1, 2])
def test_in_a_dark_patch_of_a_bright_scene_the_deviation_is_that_of_the_patch(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scene = np.full((60, 120), 1000.0)
    scene[15:45, 40:80] = 60.0
    z = []
    for _ in range(150):
        true = Drawn(60 + rng.uniform(-0.5, 0.5), 30 + rng.uniform(-0.5, 0.5), 3e3, 1.5, 1.5)
        on, off = draw([true], rng, ambient=scene), draw([], rng, ambient=scene)
        (spot,) = find_spots(on, off, expected=1, saturation_dn=4095).spots
        z += [(spot.u_px - true.u) / spot.u_sd_px, (spot.v_px - true.v) / spot.v_sd_px]
    assert 0.88 < np.std(z) < 1.12  # 300 values: 3 sd of their standard deviation are 0.12


def test_a_rim_without_used_pixels_leaves_the_floor_unchanged() -> None:
    floor = np.ones(1)
    assert not _take_floor_from_rim(floor, np.zeros((1, STATISTIC_COLUMNS)))
    assert floor[0] == 1.0


def table_of(light: np.ndarray, start: list[float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Row of the table for one window (side, side) about u = 50, v = 40; row, column of the next."""
    side, found = len(light), np.zeros((1, COLUMNS))
    data = light[None] + np.random.default_rng(1).normal(0.0, 1.0, (1, side, side))
    rows, cols = np.array([40.0]), np.array([50.0])
    usable, clip = np.ones(data.shape, bool), np.full(data.shape, np.inf)
    group = np.array([0])
    fit_group(data, usable, clip, group, rows, cols, np.array([start]), 1.0, 0.01, 0.0, (80, 100), found)
    return found[0], rows, cols


def test_the_row_of_a_spot_has_its_values_in_pixels_of_the_image() -> None:
    found, _, _ = table_of(profile((11, 11), Drawn(5.2, 4.9, 4e3)), [0.0, 3e3, 50.0, 40.0, 0.0, 0.0])
    assert (found[IS_SPOT], found[NEXT_HALF]) == (1.0, 0.0)
    assert found[U] == pytest.approx(50.2, abs=4.5 * found[U_SD])
    assert found[V] == pytest.approx(39.9, abs=4.5 * found[V_SD])
    assert found[FLUX] == pytest.approx(4e3, abs=4.5 * found[FLUX_SD])
    assert found[PEAK] == pytest.approx(4e3 / (2 * np.pi * (1.3**2 + 1 / 12)), rel=0.05)


def test_a_spot_that_outgrows_its_window_requests_the_next_one() -> None:
    found, _, _ = table_of(
        profile((11, 11), Drawn(5.0, 5.0, 4e4, 2.2, 2.2)), [0.0, 3e4, 50.0, 40.0, 0.6, 0.6]
    )
    assert (found[IS_SPOT], found[NEXT_HALF]) == (1.0, 8.0)


def test_a_spot_off_the_middle_of_its_window_has_it_moved() -> None:
    found, rows, cols = table_of(profile((11, 11), Drawn(7.2, 4.0, 4e3)), [0.0, 3e3, 52.0, 39.0, 0.0, 0.0])
    assert (found[NEXT_HALF], cols[0], rows[0]) == (5.0, 52.0, 39.0)


def test_neither_an_empty_window_nor_a_single_pixel_is_a_spot() -> None:
    empty = np.zeros((11, 11))
    single = empty.copy()
    single[5, 5] = 500.0
    for light in (empty, single):
        assert table_of(light, [0.0, 3e3, 50.0, 40.0, 0.0, 0.0])[0][IS_SPOT] == 0.0


@pytest.mark.parametrize(("outliers", "dropped"), [(1, 1), (3, 3), (4, 0)])
def test_a_few_pixels_that_no_spot_explains_are_left_out(outliers: int, dropped: int) -> None:
    """More than three are a spot that is not understood, and stay."""
    usable, signal = np.ones((2, 11, 11), bool), np.full((2, 11, 11), 10.0)
    residual, weight = np.zeros((2, 11, 11)), np.ones((2, 11, 11))
    residual[1, 3, :outliers] = 6.1
    residual[1, 5, 5] = 5.9
    statistics = np.zeros((2, STATISTIC_COLUMNS))
    statistics[:, WORST_EXCESS] = (weight * residual**2).max(axis=(1, 2))
    kept, changed = without_outliers(usable, signal, residual, weight, statistics)
    assert changed == bool(dropped)
    assert (~kept).sum() == dropped
    assert usable.all()
    assert kept[0].all()


IMAGE = (60, 90)
SHARP = {FLUX: 100.0, U: 20.0, V: 30.0, LN_SU: np.log(1.2), LN_SV: np.log(1.2)}
CERTAIN = {INFORMATION: 1e4, FLUX_NOISE: 1.0, RIM_NOISE: 1.0}


def is_spot(params: dict[int, float], statistics: dict[int, float]) -> bool:
    """Whether a fit counts as a spot that differs in some columns from a clear one."""
    row, own = np.zeros(7), np.zeros(STATISTIC_COLUMNS)
    for filled, values in ((row, SHARP | params), (own, CERTAIN | statistics)):
        filled[list(values)] = list(values.values())
    return bool(_is_spot(row, own, IMAGE))


@pytest.mark.parametrize(
    ("params", "good"),
    [
        ({}, True),
        ({FLUX: -100.0}, False),
        ({U: -0.4}, True),
        ({U: -0.6}, False),
        ({V: -0.4}, True),
        ({V: -0.6}, False),
        ({U: 89.4}, True),
        ({U: 89.6}, False),
        ({V: 59.4}, True),
        ({V: 59.6}, False),
        # 0.6 px is the narrowest that a lens is specified with; a hot pixel is narrower.
        ({LN_SU: np.log(0.6), LN_SV: np.log(0.6)}, True),
        ({LN_SU: np.log(0.4), LN_SV: np.log(0.4)}, False),
        # The mean of both widths counts.
        ({LN_SU: np.log(0.3), LN_SV: np.log(1.2)}, True),
        ({LN_SU: np.log(6.0), LN_SV: np.log(6.0)}, True),
        ({LN_SU: np.log(8.0), LN_SV: np.log(8.0)}, False),
    ],
)
def test_a_spot_is_light_of_a_lens_s_width_inside_the_image(params: dict[int, float], good: bool) -> None:
    assert is_spot(params, {}) == good


@pytest.mark.parametrize(
    ("statistics", "good"),
    [
        # The signal-to-noise ratio of a matched filter exceeds 6, in the noise of the rim if that is higher.
        ({INFORMATION: 5.9**2}, False),
        ({INFORMATION: 6.1**2}, True),
        ({INFORMATION: 2 * 5.9**2, RIM_NOISE: 2.0}, False),
        ({INFORMATION: 2 * 6.1**2, RIM_NOISE: 2.0}, True),
        ({INFORMATION: 5.9**2, RIM_NOISE: 0.5}, False),
        # The flux exceeds three standard deviations with the background free.
        ({FLUX_NOISE: 100.0 / 2.9}, False),
        ({FLUX_NOISE: 100.0 / 3.1}, True),
        ({FLUX_DEVIATION: 100.0}, True),
    ],
)
def test_a_spot_exceeds_the_noise(statistics: dict[int, float], good: bool) -> None:
    assert is_spot({}, statistics) == good


@pytest.mark.parametrize("information", [50.0, 1e3, 1e9])
def test_all_deviations_of_a_row_are_inflated_alike(information: float) -> None:
    """By the next order of 1 / A, whose factor for a position is 13 (docs/spots.md)."""
    columns = {
        FLUX_SD: FLUX_DEVIATION,
        FLUX_NOISE_SD: FLUX_NOISE,
        U_SD: U_DEVIATION,
        V_SD: V_DEVIATION,
        U_SPECKLE_SD: U_SPECKLE,
        V_SPECKLE_SD: V_SPECKLE,
    }
    statistics, row = np.zeros(STATISTIC_COLUMNS), np.full(COLUMNS, -1.0)
    statistics[[*columns.values()]] = (20.0, 15.0, 0.02, 0.03, 0.05, 0.07)
    statistics[INFORMATION], statistics[PEAK_DN] = information, 300.0
    params = np.array([2.0, 900.0, 20.0, 30.0, 0.1, 0.2])
    _fill_row(params, statistics, 0.4, 0.01, row)
    variances = (row[[*columns]] / statistics[[*columns.values()]]) ** 2
    np.testing.assert_allclose(variances, 1.0 + 13.0 / information)
    np.testing.assert_array_equal(row[:6], params)
    assert (row[SHEAR], row[PEAK], row[IS_SPOT], row[NEXT_HALF]) == (0.0, 300.0, 1.0, -1.0)


def test_turned_ellipses_of_a_group_are_fitted_each_in_its_own_window() -> None:
    """The shear of an ellipse is covariance over variance along v; a round spot in between has none."""
    angles, peaks, side = (0.6, 0.0, -0.6), ((20.0, 15.0), (50.0, 25.0), (70.0, 40.0)), 15
    spots = [Drawn(7.1, 6.9, 4e4, 2.0 if angle else 1.5, 1.5, angle) for angle in angles]
    rng = np.random.default_rng(1)
    data = np.array([profile((side, side), spot) for spot in spots])
    data += rng.normal(0.0, np.sqrt(1.0 + 0.01 * data))
    cols, rows = np.array(peaks).T
    start = np.array([[0.0, 3e4, u, v, 0.5, 0.5] for u, v in peaks])
    found, usable, clip = np.zeros((3, COLUMNS)), np.ones(data.shape, bool), np.full(data.shape, np.inf)
    fit_group(data, usable, clip, np.arange(3), rows, cols, start, 1.0, 0.01, 0.0, (60, 90), found)
    for row, (u, v), spot in zip(found, peaks, spots, strict=True):
        turn = np.array([[np.cos(spot.angle), -np.sin(spot.angle)], [np.sin(spot.angle), np.cos(spot.angle)]])
        covariance = turn @ np.diag([spot.su**2, spot.sv**2]) @ turn.T
        assert row[IS_SPOT] == 1.0
        assert row[SHEAR] == pytest.approx(covariance[0, 1] / covariance[1, 1], abs=0.05)
        assert row[U] == pytest.approx(u + 0.1, abs=4.5 * row[U_SD])
        assert row[V] == pytest.approx(v - 0.1, abs=4.5 * row[V_SD])
