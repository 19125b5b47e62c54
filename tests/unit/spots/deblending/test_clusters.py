"""Which fitted spots are one, disturb each other, or stand alone."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.draw import Drawn, Sensor, draw
from tests.support.spot_models import fitted_spot
from workbench.spots import find_spots
from workbench.spots.deblending.clusters import (
    CLEAR_SNR,
    TAIL_WIDTHS,
    are_separate,
    clusters,
    is_isolated,
    overlap,
    separation_px,
    without_duplicates,
    without_rivals,
)
from workbench.spots.kernels.windows import half_for


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


APART = {
    "two pairs, one above the other": [(36.0, 25.0), (43.0, 25.0), (36.0, 34.0), (43.0, 34.0)],
    "three in a row and one below": [(30.0, 25.0), (37.0, 25.0), (44.0, 25.0), (37.0, 35.0)],
    "two on a diagonal": [(40.0, 30.0), (45.0, 35.0)],
    "a long chain": [(10.0 + 10.0 * n, 30.0) for n in range(8)],
}
"""Clear spots whose windows overlap and whose light does not mix."""


@pytest.mark.parametrize("expected", [True, False])
@pytest.mark.parametrize("places", APART.values(), ids=APART)
def test_spots_in_each_other_s_windows_are_each_found_once(
    places: list[tuple[float, float]], expected: bool
) -> None:
    for seed in range(5):
        random = rng(seed)
        moved = sorted((u + random.uniform(-0.4, 0.4), v + random.uniform(-0.4, 0.4)) for u, v in places)
        true = [Drawn(u, v, 2e4, 0.9, 0.9) for u, v in moved]
        on, off = draw(true, random, (60, 90)), draw([], random, (60, 90))
        spots = find_spots(on, off, expected=len(true) if expected else None, saturation_dn=4095).spots
        assert len(spots) == len(true)
        for spot, t in zip(spots, true, strict=True):
            assert spot.u_px == pytest.approx(t.u, abs=5 * spot.u_sd_px)
            assert spot.v_px == pytest.approx(t.v, abs=5 * spot.v_sd_px)


@pytest.mark.parametrize(("seed", "number"), [(11, 448), (11, 1369), (1, 195)])
def test_a_spike_of_noise_is_not_taken_for_the_wide_spot_under_it(seed: int, number: int) -> None:
    # Frames on which a narrow fit in a small window settles 6 to 31 of its deviations from the spot.
    rng = np.random.default_rng([seed, 400, 1000])
    phases = rng.uniform(-0.5, 0.5, (2000, 2))
    for phase in phases[: number + 1]:
        true = Drawn(40 + phase[0], 40 + phase[1], 1e3, 4.0, 4.0)
        frame = draw([true], rng, (81, 81), Sensor(), 5.0)
    (spot,) = find_spots(frame, saturation_dn=4095).spots
    assert spot.width_px > 2.5
    assert abs(spot.u_px - true.u) < 4 * spot.u_sd_px
    assert abs(spot.v_px - true.v) < 4 * spot.v_sd_px


WIDTH = 1.2
DISTURBED_PX = half_for(WIDTH) + TAIL_WIDTHS * WIDTH
"""Light of a spot reaches into the window of another that is nearer than this."""


def test_spots_are_apart_where_no_light_falls_into_another_window() -> None:
    assert are_separate([])
    assert are_separate([fitted_spot(10.0, 10.0)])
    for distance, apart in ((DISTURBED_PX + 0.01, True), (DISTURBED_PX - 0.01, False)):
        pair = [fitted_spot(10.0, 10.0, WIDTH), fitted_spot(10.0, 10.0 + distance, WIDTH)]
        assert separation_px(*pair) == pytest.approx(distance)
        assert are_separate(pair) == apart
        assert len(clusters(pair)) == 1 + apart


def test_a_chain_of_neighbours_is_one_cluster_strongest_first() -> None:
    chain = [fitted_spot(10.0 + 0.9 * n * DISTURBED_PX, 10.0, WIDTH, 1000.0 * (n + 1)) for n in range(4)]
    far = fitted_spot(10.0, 10.0 + 2 * DISTURBED_PX, WIDTH)
    # In an order in which a later one joins two that had been apart.
    found = clusters([chain[0], chain[2], far, chain[3], chain[1]])
    assert sorted(map(len, found)) == [1, 4]
    assert next(group for group in found if len(group) == 4) == chain[::-1]


def test_of_fits_that_ended_on_one_spot_the_brightest_is_kept() -> None:
    bright, same = fitted_spot(10.0, 10.0, WIDTH, 2e3), fitted_spot(10.6, 10.0, WIDTH, 1e3)
    other = fitted_spot(12.0, 10.0, WIDTH, 1e3)
    assert without_duplicates([same, other, bright]) == [bright, other]


def test_of_a_faint_spot_and_its_rival_the_clearer_is_kept() -> None:
    faint = fitted_spot(10.0, 10.0, 1.0, flux_snr=0.9 * CLEAR_SNR)
    clear = fitted_spot(30.0, 10.0, 1.0, flux_snr=1.1 * CLEAR_SNR)
    better, worse = fitted_spot(13.0, 10.0, 4.0, flux_snr=20.0), fitted_spot(13.0, 10.0, 4.0, flux_snr=1.0)
    assert without_rivals([faint, clear], [better]) == [clear, better]
    assert without_rivals([faint, clear], [worse]) == [faint, clear]
    # A clear one gives way to nothing.
    assert without_rivals([clear], [fitted_spot(31.0, 10.0, 4.0, flux_snr=90.0)])[0] is clear
    assert without_rivals([], [worse]) == [worse]


def test_light_mixes_within_the_tails_of_both_spots() -> None:
    one = fitted_spot(10.0, 10.0, 1.0)
    reach = TAIL_WIDTHS * (1.0 + 2.0)
    near, far = fitted_spot(10.0 + 0.99 * reach, 10.0, 2.0), fitted_spot(10.0 + 1.01 * reach, 10.0, 2.0)
    assert overlap(one, near)
    assert not overlap(one, far)
    assert not is_isolated(one, [far, near])
    assert is_isolated(one, [far])
    assert not is_isolated(fitted_spot(10.0, 10.0, 1.0, flux_snr=0.9 * CLEAR_SNR), [far])
