"""The tests of residuals: their chances are chances, and each finds what it is for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import cast

import numpy as np
import pytest
from scipy.stats import chi2, norm

from tests.support.rigs import STANDOFFS_MM, World, prior, thesis_rig
from workbench.calibration.checks import residuals
from workbench.calibration.checks.residuals import alarms, explain, residual_tests
from workbench.calibration.data.observations import Observation
from workbench.calibration.estimation.fit import CalibrationFit, fit
from workbench.model.fit_event import ResidualTest

RIG = thesis_rig()
FITS = 40
Spoil = Callable[[list[Observation], np.random.Generator], list[Observation]]


def noisier(
    observations: list[Observation], rng: np.random.Generator, which: Callable[[Observation], bool]
) -> list[Observation]:
    """Some readings with four times the noise stated."""
    return [
        replace(s, u_px=s.u_px + rng.normal(0, 0.12), v_px=s.v_px + rng.normal(0, 0.12)) if which(s) else s
        for s in observations
    ]


def lagging(observations: list[Observation], rng: np.random.Generator) -> list[Observation]:
    """Every reading still has some of the one before."""
    found = list(observations)
    for n in range(1, len(found)):
        if found[n].repeat:
            before, now = found[n - 1], found[n]
            found[n] = replace(
                now, u_px=0.6 * now.u_px + 0.4 * before.u_px, v_px=0.6 * now.v_px + 0.4 * before.v_px
            )
    return found


SPOILT: list[tuple[str, Spoil]] = [
    ("repeats: laser: L2", lambda s, rng: noisier(s, rng, lambda one: one.laser_id == "L2")),
    ("repeats: over standoff", lambda s, rng: noisier(s, rng, lambda one: one.standoff_mm > 1000)),
    (
        "repeats: u and v",
        lambda s, rng: [replace(one, v_px=one.v_px + rng.normal(0, 0.06)) for one in s],
    ),
    ("repeats: order", lagging),
]


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(("name", "spoil"), SPOILT, ids=[name for name, _ in SPOILT])
def test_what_is_wrong_with_repeats_is_found(name: str, spoil: Spoil, seed: int) -> None:
    observations = spoil(World(RIG, seed).observations(repeats=8), np.random.default_rng(seed))
    found = alarms(residual_tests(fit(RIG, observations)))
    assert name in {test.name for test in found}
    assert all("by chance in 1 of" in explain(test) for test in found)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_picture_bent_as_no_lens_of_the_model_does_shows(seed: int) -> None:
    """An S across the picture of 1 px at its edges. (p1 and p2 look like another principal point.)"""
    observations = [
        replace(s, v_px=s.v_px + ((s.u_px - 320) / 320) ** 3) for s in World(RIG, seed).observations()
    ]
    assert {"u", "laser"} & {test.name for test in alarms(residual_tests(fit(RIG, observations)))}


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_lasers_with_speckle_of_their_own_show(seed: int) -> None:
    """L3's spots scatter by 0.3 px between placements, not between repeats."""
    rng = np.random.default_rng(seed)
    shift = {s: rng.normal(0, 0.3, 2) for s in STANDOFFS_MM}
    observations = [
        replace(s, u_px=s.u_px + float(shift[s.standoff_mm][0]), v_px=s.v_px + float(shift[s.standoff_mm][1]))
        if s.laser_id == "L3"
        else s
        for s in World(RIG, seed).observations()
    ]
    assert "variance of laser: L3" in {test.name for test in alarms(residual_tests(fit(RIG, observations)))}


def test_chances_of_sound_calibrations_are_chances() -> None:
    """A tenth below 0.1, of every kind; 2000 are tried by `python -m tests.proofs.validation`."""
    chances: dict[str, list[float]] = {}
    for seed in range(800, 800 + FITS):
        for test in residual_tests(fit(RIG, World(RIG, seed).observations())):
            chances.setdefault(test.name.partition(": L")[0], []).append(test.p)
    assert set(chances) >= {"standoff", "laser", "u", "order", "variance of u and v", "repeats: order"}
    assert "v" not in chances  # four lasers in one line: their v tells nothing
    everything = np.concatenate([np.array(c) for c in chances.values()])
    assert (everything < 0.1).mean() == pytest.approx(0.1, abs=4 * np.sqrt(0.09 / len(everything)))
    for name, values in chances.items():
        assert (np.array(values) < 0.1).mean() < 0.1 + 4 * np.sqrt(0.09 / len(values)), name


def test_lasers_above_the_camera_are_tested_against_v() -> None:
    upright = tuple(
        laser.model_copy(
            update={"axis": "v", "x_mm": prior(0.0, 0.2), "y_mm": prior(laser.x_mm.value / 2, 0.2)}
        )
        for laser in RIG.lasers
    )
    rig = RIG.model_copy(update={"lasers": upright})
    names = {test.name for test in residual_tests(fit(rig, World(rig, 1).observations()))}
    assert "v" in names
    assert "u" not in names


def test_few_readings_leave_nothing_to_test_repeats_with() -> None:
    names = [test.name for test in residual_tests(fit(RIG, World(RIG, 1).observations(repeats=1)))]
    assert not [name for name in names if name.startswith("repeats")]


@pytest.mark.parametrize("value", [0.5, 3.0, 12.0, 30.0])
def test_the_gamma_approximation_is_exact_for_a_chi_square(value: float) -> None:
    freedom = 8
    expected = 2 * min(chi2.cdf(value, freedom), chi2.sf(value, freedom))
    assert residuals._two_sided(value, freedom, 2 * freedom, 8 * freedom) == pytest.approx(expected)
    assert residuals._two_sided(-value, -freedom, 2 * freedom, -8 * freedom) == pytest.approx(expected)


@pytest.mark.parametrize("value", [-2.0, 0.0, 1.0, 5.0])
def test_without_skewness_the_approximation_is_the_normal_distribution(value: float) -> None:
    expected = 2 * norm.sf(abs(value - 1.0) / 1.5)
    assert residuals._two_sided(value, 1.0, 1.5**2, 0.0) == pytest.approx(expected)


@pytest.mark.parametrize("repeats", [2, 8])
def test_noise_smaller_than_stated_is_no_lag_and_no_difference(repeats: int) -> None:
    loose = thesis_rig(noise_px=0.12)
    for seed in range(5):
        assert alarms(residual_tests(fit(loose, World(RIG, seed).observations(repeats=repeats)))) == ()


def test_variances_are_compared_at_the_noise_of_the_data() -> None:
    """Half of the p values are below a half, also where the noise is half of what is stated."""
    loose = thesis_rig(noise_px=0.12, speckle_px=0.08)
    fits = [fit(loose, World(RIG, seed).observations()) for seed in range(8)]
    found = [test.p for one in fits for test in residual_tests(one) if test.name.startswith("variance")]
    assert len(found) > 40
    # Binomial: sqrt(1 / 4 / 40) = 0.08, four of them.
    assert np.mean(np.array(found) < 0.5) == pytest.approx(0.5, abs=0.32)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("rounded", [False, True])
def test_repeats_that_do_not_scatter_as_noise_are_not_tested(seed: int, rounded: bool) -> None:
    """Every row three times the same, or positions rounded to ten times their noise."""
    world = World(thesis_rig(noise_px=0.01), seed)
    if rounded:
        observations = [
            replace(s, u_px=round(s.u_px, 1), v_px=round(s.v_px, 1)) for s in world.observations(repeats=8)
        ]
    else:
        observations = [replace(s, repeat=n) for s in world.observations(repeats=1) for n in range(3)]
    tests = residual_tests(fit(world.rig, observations))
    assert not [test.name for test in tests if test.name.startswith("repeats")]
    assert alarms(tests) == ()


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_repeats_rounded_to_their_noise_are_tested(seed: int) -> None:
    world = World(thesis_rig(noise_px=0.1), seed)
    observations = [
        replace(s, u_px=round(s.u_px, 1), v_px=round(s.v_px, 1)) for s in world.observations(repeats=8)
    ]
    tests = residual_tests(fit(world.rig, observations))
    assert "repeats: order" in {test.name for test in tests}
    assert alarms(tests) == ()


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(("lasers", "standoffs_mm"), [(1, (400.0,)), (1, (200.0, 800.0)), (4, (400.0,))])
def test_hardly_any_data_are_tested_for_nothing(
    seed: int, lasers: int, standoffs_mm: tuple[float, ...]
) -> None:
    rig = RIG.model_copy(update={"lasers": RIG.lasers[:lasers]})
    for repeats in (1, 2):
        tests = residual_tests(fit(rig, World(rig, seed).observations(standoffs_mm, repeats)))
        assert all(0 <= test.p <= 1 for test in tests)
        assert alarms(tests) == ()


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_unmeasured_coordinate_has_the_place_where_the_fit_puts_it(seed: int) -> None:
    """One laser read in v alone: its u is off the middle of the picture all the same."""
    camera = RIG.camera.model_copy(update={"cx_px": prior(200.0, 1.0)})
    rig = RIG.model_copy(update={"camera": camera})
    observations = World(rig, seed).observations()
    blind = fit(rig, [replace(s, u_px=float("nan")) if s.laser_id == "L2" else s for s in observations])
    of_l2 = blind.cells.laser == rig.laser_ids.index("L2")
    spots = residuals._Spots.of(blind)
    seen = np.array([s.u_px for s in observations if s.laser_id == "L2" and s.repeat == 0])
    mine = spots.laser == rig.laser_ids.index("L2")
    assert mine.sum() == of_l2.sum() == len(seen)
    # The other lasers say where the lens is; the prior of the pointing where L2 goes: within some 15 px.
    assert np.abs((spots.place[mine, 0] + 1) * 320 - seen).max() < 15
    assert np.ptp(spots.place[mine, 0]) > 0.2


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("count", [2, 3, 8])
def test_the_moments_of_the_lag_are_those_of_a_quadratic_form_in_gaussian_noise(
    count: int, seed: int
) -> None:
    """Cumulants are sums of powers of the eigenvalues, on the space that subtracting the mean leaves."""
    rng = np.random.default_rng(seed)
    direction = rng.uniform(0.5, 2.0, count)
    direction /= np.linalg.norm(direction)
    left = np.eye(count) - np.outer(direction, direction)
    deviation = left @ rng.normal(size=count)
    repeats = residuals._Repeats(0, 0, deviation, direction)
    neighbours = np.zeros((count, count))
    for n in range(count - 1):
        neighbours[n, n + 1] = neighbours[n + 1, n] = 0.5
    of_lag = np.linalg.eigvalsh(left @ neighbours @ left)
    assert repeats.lag_mean() == pytest.approx(of_lag.sum())
    mean = 0.3
    eigenvalues = np.linalg.eigvalsh(left @ (neighbours - mean * np.eye(count)) @ left)
    value = float((deviation[:-1] * deviation[1:]).sum() - mean * deviation @ deviation)
    expected = (value, 2 * (eigenvalues**2).sum(), 8 * (eigenvalues**3).sum())
    assert repeats.lag(mean) == pytest.approx(expected)


def test_values_are_spread_over_two() -> None:
    np.testing.assert_allclose(residuals._spread(np.array([3.0, 5.0, 4.0, 3.5])), [-1.0, 1.0, 0.0, -0.5])
    np.testing.assert_array_equal(residuals._spread(np.array([3.0, 3.0])), [0.0, 0.0])


@pytest.mark.parametrize("count", [1, 10])
def test_one_of_a_hundred_sound_fits_has_an_alarm(count: int) -> None:
    """Bonferroni: the rates of all tests add up to a hundredth."""
    for share, alarm in ((0.95, True), (1.05, False)):
        one = ResidualTest(name="u", p=share * 0.01 / count)
        rest = (ResidualTest(name="v", p=0.5),) * (count - 1)
        assert alarms((*rest, one)) == ((one,) if alarm else ())


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("axis", [0, 1])
def test_drift_along_either_axis_is_an_order_of_captures(axis: int, seed: int) -> None:
    """Two hundred captures; one coordinate wanders, the other has the noise that is stated."""
    rng = np.random.default_rng(seed)
    both = rng.normal(size=(200, 2))
    both[:, axis] = np.convolve(rng.normal(size=204), np.full(5, 5**-0.5), "valid")
    count = both.size
    spots = residuals._Spots(
        residual=both.ravel(),
        covariance=np.eye(count),
        sd_px=np.ones(count),
        laser=np.zeros(count, int),
        axis=np.tile([0, 1], 200),
        outward=np.zeros(count),
        distance=np.zeros(count),
        place=np.zeros((count, 2)),
    )
    name, p = next(residuals._of_spots(cast(CalibrationFit, None), spots))
    assert name == "order"
    assert p < 1e-3
    white = replace(spots, residual=rng.normal(size=count))
    assert next(residuals._of_spots(cast(CalibrationFit, None), white))[1] > 1e-3


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_more_repeats_at_far_standoffs_are_no_larger_variance(seed: int) -> None:
    observations = [
        s for s in World(RIG, seed).observations(repeats=12) if s.standoff_mm > 900 or s.repeat < 2
    ]
    p_values = {test.name: test.p for test in residual_tests(fit(RIG, observations))}
    assert p_values["repeats: over standoff"] > 1e-3
