"""Which fitted spots are one, disturb each other, or stand alone."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.draw import Drawn, Sensor, draw
from workbench.spots import find_spots


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
