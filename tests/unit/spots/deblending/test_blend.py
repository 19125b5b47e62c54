"""Overlapping spots are separated, and isolated neighbours are kept."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.support.draw import Drawn, Sensor, draw, profile
from tests.support.spot_models import fitted_spot, pixel_noise, scene_of
from workbench.model.arrays import FloatArray
from workbench.spots import Failure, Scanline, find_spots
from workbench.spots.deblending import blend
from workbench.spots.deblending.blend import (
    Blend,
    _Candidates,
    _elongated_as_pairs,
    _is_significant,
    _least_significant,
    fit_blends,
    split_elongated,
    with_hidden_spots,
)
from workbench.spots.deblending.joint_fit import JointFit, fit_joint, pair_guess
from workbench.spots.fit import Windows
from workbench.spots.kernels.columns import FLUX, LN_SU, U
from workbench.spots.measure import FittedSpot
from workbench.spots.pair import PairSignal

ROW = [Scanline(0, 30, 1, 0, 3)]


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.mark.parametrize("apart", [2.6, 3.5, 5.0, 8.0])
def test_overlapping_spots_are_separated(apart: float) -> None:
    true = [Drawn(50, 30, 4e4), Drawn(50 + apart, 30.2, 2e4)]
    finding = find_spots(draw(true, rng(3), ambient=5.0), scanlines=ROW, expected=2)
    assert len(finding.spots) == 2
    for spot, t in zip(finding.spots, true, strict=True):
        assert spot.u_px == pytest.approx(t.u, abs=5 * spot.u_sd_px)
    assert (Failure.MERGED in finding.failures) == (apart < 4 * 1.3)


CLUSTERS = {
    "three side by side": [(13.8, 20.0), (13.9, 24.1), (8.8, 22.7), (21.3, 23.7)],
    "a merged pair and two more": [(13.8, 16.7), (14.4, 24.5), (24.6, 22.9), (27.6, 22.2)],
    "two merged pairs": [(13.4, 20.6), (16.7, 20.6), (23.3, 20.6), (26.6, 20.6)],
}
"""Centres (u, v) of the spots of four lasers on a distant target."""


SPECKLE = 0.2


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("cluster", CLUSTERS)
def test_a_cluster_of_spots_is_separated(cluster: str, seed: int) -> None:
    """In speckle, whose noise hides the neighbours of a spot from a model that lacks them."""
    places, random = sorted(CLUSTERS[cluster]), rng(seed)
    light = np.sum([profile((40, 40), Drawn(u, v, 5000.0, 0.75, 0.75)) for u, v in places], axis=0)
    grains = random.gamma(SPECKLE**-2, SPECKLE**2, light.shape)
    frame = Sensor(10.0, 6.0, 8).expose(20.0 + light * grains, random)
    spots = find_spots(frame, expected=4).spots
    assert len(spots) == 4
    for spot, (u, v) in zip(spots, places, strict=True):
        assert spot.u_px == pytest.approx(u, abs=5 * math.hypot(spot.u_sd_px, spot.u_speckle_sd_px or 0.0))
        assert spot.v_px == pytest.approx(v, abs=5 * math.hypot(spot.v_sd_px, spot.v_speckle_sd_px or 0.0))


@pytest.mark.parametrize("share", [0.1, 0.05])
def test_a_clear_spot_on_dark_paper_is_not_dropped_for_its_neighbours(share: float) -> None:
    true = [Drawn(30.2 + 6.5 * n, 30.1, (1.0, share, 1.0, 1.0)[n] * 5e4, 0.85, 0.85) for n in range(4)]
    for seed in range(5):
        random = rng(seed)
        on, off = draw(true, random), draw([], random)
        spots = find_spots(on, off, scanlines=ROW, expected=4, saturation_dn=4095).spots
        assert [round(s.u_px) for s in spots] == [30, 37, 43, 50]


def test_neighbours_on_the_second_of_two_scanlines_are_both_found() -> None:
    true = [Drawn(20, 30), Drawn(30, 12), Drawn(30.2, 19), Drawn(45, 30)]
    lines = [Scanline(0, 30, 1, 0, 2), Scanline(30, 0, 0, 1, 2)]
    for order in (lines, lines[::-1]):
        spots = find_spots(draw(true, rng(), (60, 60)), scanlines=order, expected=4).spots
        assert sorted((round(s.u_px), round(s.v_px)) for s in spots) == [
            (20, 30),
            (30, 12),
            (30, 19),
            (45, 30),
        ]


def test_an_ellipse_is_not_split() -> None:
    frame = draw([Drawn(50, 30, 4e4, 2.6, 1.3)], rng(4), ambient=5.0)
    assert len(find_spots(frame, scanlines=ROW).spots) == 1


def scene_with(*drawn: Drawn, seed: int) -> tuple[PairSignal, list[FittedSpot]]:
    """A scene, and its spots as if they had been fitted."""
    random = rng(seed)
    scene = scene_of(draw(drawn, random), draw([], random))
    return scene, [fitted_spot(d.u, d.v, d.su, d.electrons / 8.0, scene=scene) for d in drawn]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_blend_is_fitted_in_pixels_of_its_window_and_comes_back_in_those_of_the_image(seed: int) -> None:
    true = [Drawn(60.2, 30.1, 4e4), Drawn(64.4, 31.8, 3e4)]
    scene, group = scene_with(*true, seed=seed)
    blend = Blend([scene], group, [])
    assert blend.is_within_limit
    start = blend.start_of(group)
    np.testing.assert_allclose(start[:, 2] + blend.col0, [60.2, 64.4])
    np.testing.assert_allclose(start[:, 3] + blend.row0, [30.1, 31.8])
    assert blend.win.data[0, 3, 4] == pytest.approx(scene.signal[blend.row0 + 3, blend.col0 + 4])
    for trace, drawn in zip(
        blend.as_fitted_spots(fit_joint(blend.win, start, blend.noise)), true, strict=True
    ):
        assert trace.spot.u_px == pytest.approx(drawn.u, abs=4.5 * trace.spot.u_sd_px)
        assert trace.spot.v_px == pytest.approx(drawn.v, abs=4.5 * trace.spot.v_sd_px)
        # Nearer than four widths.
        assert trace.spot.flags == {Failure.MERGED}


def test_light_of_others_is_not_used() -> None:
    scene, (one, other) = scene_with(Drawn(60.0, 30.0), Drawn(67.0, 30.0), seed=1)
    blend = Blend([scene], [one], [other])
    v, u = np.mgrid[: blend.win.shape[0], : blend.win.shape[1]]
    other_light = np.hypot(u + blend.col0 - 67.0, v + blend.row0 - 30.0) < 2.5 * 1.3
    assert other_light.any()
    assert not blend.win.usable[0][other_light].any()
    assert not blend.allowed[other_light].any()
    assert blend.allowed[~other_light].all()


def test_spots_too_far_from_each_other_do_not_fit_into_one_window() -> None:
    scene = scene_of(np.zeros((20, 400), np.uint16))
    ends = [fitted_spot(u, 10.0, scene=scene) for u in (10.0, 300.0)]
    assert not Blend([scene], ends, []).is_within_limit
    assert fit_blends([scene], ends, [], wants_more=False) == ends


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_elongated_spot_is_two_and_a_round_one_stays(seed: int) -> None:
    true = [Drawn(60.0, 30.0, 4e4), Drawn(63.5, 30.0, 3e4)]
    random = rng(seed)
    scene = scene_of(draw(true, random), draw([], random))
    whole = fitted_spot(61.5, 30.0, 2.2, 7e4 / 8.0, scene=scene)
    two = sorted(split_elongated([scene], whole, []), key=lambda t: t.spot.u_px)
    assert len(two) == 2
    for trace, drawn in zip(two, true, strict=True):
        assert trace.spot.u_px == pytest.approx(drawn.u, abs=4.5 * trace.spot.u_sd_px)
    scene, (single,) = scene_with(Drawn(60.0, 30.0, 4e4), seed=seed)
    assert split_elongated([scene], single, []) == [single]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_member_that_is_not_there_is_dropped_and_a_hidden_one_is_found(seed: int) -> None:
    true = [Drawn(60.0, 30.0, 4e4), Drawn(65.0, 30.0, 2e4)]
    scene, group = scene_with(*true, seed=seed)
    false = fitted_spot(62.0, 34.0, 1.3, 300.0, flux_snr=4.0, scene=scene)
    kept = fit_blends([scene], [*group, false], [], wants_more=False)
    assert sorted(round(t.spot.u_px) for t in kept) == [60, 65]
    more = with_hidden_spots([scene], group[:1], [])
    assert sorted(round(t.spot.u_px) for t in more) == [60, 65]


WIDE = Windows(np.zeros((1, 20, 30)), np.ones((1, 20, 30), bool), np.full((1, 20, 30), np.inf))
PIXELS = 30
"""Few, so that the number of parameters counts."""


def joint_of(*spots: tuple[float, float, float], width_px: float = 1.5, **changed: Any) -> JointFit:
    """A fit with spots (u, v, flux) known to 1 DN, and chi2 as expected."""
    weight = np.zeros((20, 30))
    weight.flat[:PIXELS] = 1.0
    params = np.array([[0.0, flux, u, v, *[np.log(width_px)] * 2] for u, v, flux in spots])
    k = len(spots)
    fitted = JointFit(
        params=params,
        sd=np.ones((k, 3)),
        speckle_sd=np.zeros((k, 2)),
        chi2=PIXELS - 3.0 - 3.0 * k,
        signal=np.zeros_like(weight),
        residual=np.zeros_like(weight),
        weight=weight,
        noise=pixel_noise(1.0, 0.01),
        converged=True,
    )
    return replace(fitted, **changed)


def is_significant(two: JointFit, f: float = 20.0, min_share: float = 0.1) -> bool:
    """Whether the second of several spots is significant where it lowers chi2 by three times `f`."""
    one = replace(two, chi2=two.chi2 + 3.0 * f)
    return _is_significant(one, two, WIDE, _Candidates([1], min_share))


CLEAR = ((10.0, 9.0, 1000.0), (16.0, 9.0, 800.0))


@pytest.mark.parametrize(
    ("second", "significant"),
    [
        ((16.0, 9.0, 800.0), True),
        # Centres nearer than a width.
        ((11.6, 9.0, 800.0), True),
        ((11.4, 9.0, 800.0), False),
        ((10.0, 10.4, 800.0), False),
        # A share of the strongest.
        ((16.0, 9.0, 105.0), True),
        ((16.0, 9.0, 95.0), False),
        # Centres outside the window of 20 x 30.
        ((-0.1, 9.0, 800.0), False),
        ((29.9, 19.9, 800.0), True),
        ((30.1, 9.0, 800.0), False),
        ((16.0, 20.1, 800.0), False),
    ],
)
def test_a_second_spot_is_apart_bright_and_inside(
    second: tuple[float, float, float], significant: bool
) -> None:
    assert is_significant(joint_of(CLEAR[0], second)) == significant


def test_a_second_spot_exceeds_its_noise() -> None:
    two = joint_of(*CLEAR)
    assert is_significant(replace(two, sd=np.array([[1.0] * 3, [800.0 / 5.1] * 3])))
    assert not is_significant(replace(two, sd=np.array([[1.0] * 3, [800.0 / 4.9] * 3])))
    assert not is_significant(replace(two, converged=False))


@pytest.mark.parametrize("spots", [CLEAR, (*CLEAR, (22.0, 9.0, 900.0))])
def test_a_second_spot_lowers_the_misfit_by_an_f_test(spots: tuple[tuple[float, float, float], ...]) -> None:
    """Three parameters more; what is left is as large as its degrees of freedom."""
    assert is_significant(joint_of(*spots), f=10.2)
    assert not is_significant(joint_of(*spots), f=9.8)


@pytest.mark.parametrize(("removable", "dropped"), [([0, 1, 2], 1), ([0, 2], 2), ([0], 0)])
def test_the_faintest_spot_over_its_noise_is_dropped_first(removable: list[int], dropped: int) -> None:
    full = joint_of((5.0, 9.0, 900.0), (12.0, 9.0, 500.0), (20.0, 9.0, 600.0))
    full.sd[:, 0] = 30.0, 50.0, 25.0
    assert _least_significant(full, full.params, removable) == dropped


@pytest.mark.parametrize(
    ("removable", "dropped"), [([0, 1, 2, 3], 1), ([2], 2), ([0, 3], 0), ([1, 3], 1), ([3], 3)]
)
def test_without_a_sound_fit_the_fainter_of_the_nearest_two_is_dropped(
    removable: list[int], dropped: int
) -> None:
    """By the first guesses: the fit ran away."""
    start = joint_of((5.0, 9.0, 900.0), (7.0, 9.0, 500.0), (12.0, 9.0, 600.0), (25.0, 9.0, 100.0)).params
    failed = replace(joint_of(*[(float("nan"), 0.0, 1.0)] * 4), converged=False)
    assert _least_significant(failed, start, removable) == dropped


def test_elongated_members_of_a_cluster_are_guessed_as_pairs() -> None:
    start = joint_of(*CLEAR, (22.0, 9.0, 900.0)).params
    start[1, LN_SU] += np.log(1.35)
    start[2, LN_SU] += np.log(1.25)
    alone = np.array([True, False, True])
    guesses, isolated = _elongated_as_pairs(start, alone)
    assert len(guesses) == 4
    assert isolated.tolist() == [True, True, False, False]
    np.testing.assert_allclose(guesses[:2, U], [10.0, 22.0])
    assert guesses[2:, U].mean() == pytest.approx(16.0)
    assert guesses[2:, FLUX].sum() == pytest.approx(800.0)
    np.testing.assert_allclose(np.exp(guesses[:, LN_SU:]), 1.5)


@pytest.mark.parametrize(("ratio", "tried"), [(1.0, False), (1.3, True)])
def test_only_an_elongated_spot_is_tried_as_two(
    ratio: float, tried: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, (one,) = scene_with(Drawn(60.0, 30.0, 4e4, 1.3 * ratio, 1.3), seed=1)
    guesses = []

    def guessed(params: FloatArray) -> FloatArray:
        guesses.append(params)
        return pair_guess(params)

    monkeypatch.setattr(blend, "pair_guess", guessed)
    split_elongated([scene], one, [])
    assert len(guesses) == tried
