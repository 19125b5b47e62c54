"""The search for an exposure, on a sensor of known response."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench.model.event import ExposureSet
from workbench.procedure.exposure import (
    BOLDEST,
    GOOD,
    MOST_TRIALS,
    best_of,
    brightest_lit_dn,
    search_exposure,
)

FULL = 255


class Sensor:
    """A pedestal, a rate (full scales per unit of exposure), noise, clipping; maybe coarse steps."""

    def __init__(self, rate: float, pedestal: float = 0.03, noise_dn: float = 0.0, step: float = 0.0) -> None:
        self.rate, self.pedestal, self.noise_dn, self.step = rate, pedestal, noise_dn, step
        self.rng = np.random.default_rng(5)
        self.asked: list[float] = []

    def __call__(self, exposure: float, trial: int) -> tuple[float, float]:
        assert trial == len(self.asked)
        self.asked.append(exposure)
        taken = max(self.step * round(exposure / self.step), self.step) if self.step else exposure
        dn = FULL * (self.pedestal + self.rate * taken) + self.noise_dn * self.rng.standard_normal()
        return taken, float(np.clip(np.rint(dn), 0, FULL)) / FULL


@given(st.floats(-1.2, 5.2), st.floats(0, 0.1), st.sampled_from([0.0, 1.5]))
def test_any_spot_that_the_limits_allow_ends_bright_and_whole(
    decade: float, pedestal: float, noise_dn: float
) -> None:
    """Rates whose exposure for the aim lies well within 1 to 10^7."""
    sensor = Sensor((0.65 - pedestal) / 10 ** (1.5 + decade), pedestal, noise_dn)
    tried = search_exposure((1.0, 1e7), sensor)
    exposure, peak = best_of(tried)
    assert GOOD[0] <= peak <= GOOD[1]
    assert len(tried) <= MOST_TRIALS
    assert GOOD[0] - 0.03 < pedestal + sensor.rate * exposure < GOOD[1] + 0.03
    steps = np.array(sensor.asked[1:]) / np.array(sensor.asked[:-1])
    assert (steps <= BOLDEST * 1.006).all(), "three digits"


@pytest.mark.parametrize(("rate", "ends_at"), [(1e-9, 1e4), (10.0, 1.0), (0.0, 1e4)])
def test_out_of_reach_it_ends_at_a_limit(rate: float, ends_at: float) -> None:
    sensor = Sensor(rate)
    tried = search_exposure((1.0, 1e4), sensor)
    assert best_of(tried)[0] == ends_at
    assert len(tried) == len(set(sensor.asked)) < MOST_TRIALS
    assert min(sensor.asked) >= 1.0
    assert max(sensor.asked) <= 1e4, "never above the rig's longest"


@pytest.mark.parametrize("step", [8.0, 30.0])
def test_a_camera_of_coarse_steps_is_not_asked_for_ever(step: float) -> None:
    """With steps of 30 none may be within the band: the longest that is not too bright is taken."""
    sensor = Sensor(0.02, step=step)
    exposure, peak = best_of(search_exposure((1.0, 1000.0), sensor))
    assert len(sensor.asked) <= MOST_TRIALS
    assert peak <= GOOD[1]
    assert 0.03 + 0.02 * (exposure + step) > GOOD[1]


def test_a_lamp_or_a_hot_pixel_is_not_the_spot() -> None:
    off = np.full((20, 30), 7, np.uint8)
    off[3, 4] = 255
    on = off.copy()
    on[10, 11] = 90
    assert brightest_lit_dn(on, off) == 90
    assert brightest_lit_dn(off, on) <= 255, "no wrap-around of unsigned numbers"
    assert brightest_lit_dn(np.full((2, 2), 255, np.uint8), np.full((2, 2), 255, np.uint8)) == 255


@pytest.mark.parametrize(("peak", "verdict", "says"), [(1.0, "clipped", "filter"), (0.1, "dim", "lie on")])
def test_what_is_not_good_is_said(peak: float, verdict: str, says: str) -> None:
    told = ExposureSet.model_validate(
        {"key": "p", "exposure": 20.0, "unit": "", "peak": peak, "verdict": verdict, "trials": 3}
    ).text
    assert told.startswith("exposure 20, brightest spot at")
    assert says in told
