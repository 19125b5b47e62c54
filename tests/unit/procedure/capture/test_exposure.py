"""The search for an exposure, on a sensor of known response."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from workbench.model.event import ExposureSet
from workbench.model.exposure import AIM, GOOD, verdict_of
from workbench.procedure.capture.brightness import Brightness
from workbench.procedure.capture.exposure import (
    LARGEST_FACTOR,
    MOST_TRIALS,
    ExposureTrial,
    best_of,
    search_exposure,
    share_of,
)

FULL = 255


class Sensor:
    """A pedestal, a rate (full scales per unit of exposure), noise, clipping; maybe coarse steps."""

    def __init__(
        self,
        rate: float,
        pedestal: float = 0.03,
        noise_dn: float = 0.0,
        step: float = 0.0,
        clips_at: float = 1.0,
        gamma: float = 1.0,
        jumps_at: float = 1.0,
        room: float = 0.0,
    ) -> None:
        self.rate, self.pedestal, self.noise_dn, self.step = rate, pedestal, noise_dn, step
        self.clips_at, self.gamma, self.jumps_at, self.room = clips_at, gamma, jumps_at, room
        self.rng = np.random.default_rng(5)
        self.asked: list[float] = []

    def __call__(self, exposure: float, number: int) -> ExposureTrial:
        assert number == len(self.asked)
        self.asked.append(exposure)
        taken = max(self.step * round(exposure / self.step), self.step) if self.step else exposure
        lit = FULL * (self.rate * taken) ** self.gamma
        dark = min(self.pedestal + self.room * taken, self.clips_at)
        dn = min(FULL * dark + lit, self.clips_at * FULL) + self.noise_dn * self.rng.standard_normal()
        dn = FULL if dn > self.jumps_at * FULL else dn
        peak = float(np.clip(np.rint(dn), 0, FULL)) / FULL
        noise = max(self.noise_dn, 0.5) / FULL
        return ExposureTrial(
            taken, Brightness(peak, peak - dark, noise) if peak - dark > 6 * noise else Brightness(dark)
        )


@given(st.floats(-1.2, 5.2), st.floats(0, 0.1), st.sampled_from([0.0, 1.5]))
def test_any_spot_that_the_limits_allow_ends_bright_and_whole(
    decade: float, pedestal: float, noise_dn: float
) -> None:
    """Rates whose exposure for the aim lies well within 1 to 10^7."""
    sensor = Sensor((0.65 - pedestal) / 10 ** (1.5 + decade), pedestal, noise_dn)
    tried = search_exposure((1.0, 1e7), sensor)
    best = best_of(tried)
    assert GOOD[0] <= share_of(best, tried) <= GOOD[1]
    assert len(tried) <= MOST_TRIALS
    assert GOOD[0] - 0.03 < pedestal + sensor.rate * best.exposure < GOOD[1] + 0.03
    steps = np.array(sensor.asked[1:]) / np.array(sensor.asked[:-1])
    assert (steps <= LARGEST_FACTOR * 1.006).all(), "three digits"


@pytest.mark.parametrize(("rate", "ends_at"), [(1e-9, 1e4), (10.0, 1.0), (0.0, 1e4)])
def test_out_of_reach_it_ends_at_a_limit(rate: float, ends_at: float) -> None:
    sensor = Sensor(rate)
    tried = search_exposure((1.0, 1e4), sensor)
    assert best_of(tried).exposure == ends_at
    assert len(tried) == len(set(sensor.asked)) < MOST_TRIALS
    assert min(sensor.asked) >= 1.0
    assert max(sensor.asked) <= 1e4, "never above the rig's longest"


@pytest.mark.parametrize("step", [8.0, 30.0])
def test_a_camera_of_coarse_steps_is_not_asked_for_ever(step: float) -> None:
    """With steps of 30 none may be within the band: the longest that is not too bright is taken."""
    sensor = Sensor(0.02, step=step)
    best = best_of(search_exposure((1.0, 1000.0), sensor))
    assert len(sensor.asked) <= MOST_TRIALS
    assert best.seen.peak <= GOOD[1]
    assert 0.03 + 0.02 * (best.exposure + step) > GOOD[1]


@given(st.floats(-0.7, 4.7), st.sampled_from([0.3, 0.45, 0.98]), st.sampled_from([0.0, 1.5]))
def test_a_number_that_does_not_grow_is_clipped(decade: float, clips_at: float, noise_dn: float) -> None:
    """A camera that makes grey of its colours by itself, or compresses: full scale is never seen."""
    right = 10 ** (1.5 + decade)
    sensor = Sensor((AIM * clips_at - 0.03) / right, noise_dn=noise_dn, clips_at=clips_at)
    tried = search_exposure((1.0, 1e7), sensor)
    best = best_of(tried)
    assert len(tried) <= MOST_TRIALS
    unclipped = 0.03 + sensor.rate * best.exposure
    assert 0.4 * clips_at < unclipped < 0.95 * clips_at
    assert share_of(best, tried) == pytest.approx(unclipped / clips_at, abs=0.09)


@given(st.floats(-0.7, 4.7), st.sampled_from([0.3, 0.45]))
@example(-0.53125, 0.45)
def test_grey_that_jumps_where_a_colour_is_clipped(decade: float, jumps_at: float) -> None:
    """The weighted mean of colours, given as clipped where one is: that colour ends below it, and bright."""
    right = 10 ** (1.5 + decade)
    sensor = Sensor((AIM * jumps_at - 0.03) / right, jumps_at=jumps_at)
    tried = search_exposure((1.0, 1e7), sensor)
    best = best_of(tried)
    assert len(tried) <= MOST_TRIALS
    assert 0.03 + sensor.rate * best.exposure > 0.5 * jumps_at
    assert sensor.rate * best.exposure <= 0.75 * (jumps_at - 0.03), "a quarter of the light is left"


@pytest.mark.parametrize("faint", [0.0, 1e-4, 1e-3, 0.1, 10.0])
@pytest.mark.parametrize("clips_at", [1.0, 0.92])
@given(decade=st.floats(0.5, 5.0), noise_dn=st.sampled_from([0.0, 1.5]))
def test_the_light_of_the_room_alone_is_never_good(
    faint: float, clips_at: float, decade: float, noise_dn: float
) -> None:
    """Lasers of that share of the room's rate: what is kept sees them, or is told as unseen."""
    room = 0.6 / 10 ** (1.0 + decade)
    sensor = Sensor(faint * room, room=room, noise_dn=noise_dn, clips_at=clips_at)
    tried = search_exposure((1.0, 1e7), sensor)
    best = best_of(tried)
    told = verdict_of(share_of(best, tried), seen=best.seen.lit > 0)
    assert len(tried) <= MOST_TRIALS
    assert (told == "unseen") == (best.seen.lit == 0)
    if faint <= 1e-3:
        assert told == "unseen"
        assert 0.5 < 0.03 + room * best.exposure <= GOOD[1] + 1e-9, "as long as the room lets it"
    if faint >= 0.1:
        assert best.seen.lit > 0
        assert best.seen.peak < clips_at


def test_where_nothing_is_seen_no_half_exposure_is_tried() -> None:
    """Not in the dark, where half of the longest would tell nothing, nor in the room's light."""
    for room in (0.0, 0.006):
        sensor = Sensor(0.0, room=room)
        tried = search_exposure((1.0, 1e4), sensor)
        assert best_of(tried).seen.lit == 0
        assert best_of(tried).exposure / 2 not in sensor.asked


@pytest.mark.parametrize("rate", [1e-5, 1e-3, 1e-1])
def test_a_camera_with_a_gamma_is_not_taken_for_clipped(rate: float) -> None:
    sensor = Sensor(rate, gamma=0.45)
    tried = search_exposure((1.0, 1e6), sensor)
    assert GOOD[0] <= share_of(best_of(tried), tried) <= GOOD[1]


@pytest.mark.parametrize(
    ("peak", "verdict"), [(1.0, "clipped"), (0.99, "bright"), (0.54, "dim"), (0.6, "good")]
)
def test_a_verdict_other_than_good_is_in_the_text(peak: float, verdict: str) -> None:
    assert verdict_of(peak, seen=True) == verdict
    assert verdict_of(peak, seen=False) == "unseen"
    text = ExposureSet.model_validate(
        {"key": "p", "exposure": 20.0, "unit": "", "peak": peak, "verdict": verdict, "trials": 3}
    ).text
    assert f"{100 * peak:.0f} %" in text
    assert (verdict in text) == (verdict != "good")


def test_room_light_is_not_called_a_spot() -> None:
    text = ExposureSet(key="p", exposure=20.0, unit="us", peak=0.6, verdict="unseen", trials=3).text
    assert "spot" not in text
    assert "20 us" in text
    assert "60 %" in text


def test_the_document_states_these_bounds() -> None:
    text = " ".join((Path(__file__).parents[4] / "docs/procedures.md").read_text().split())
    low, high = (f"{100 * bound:.0f}" for bound in GOOD)
    assert f"brought to {100 * AIM:.0f} % of full scale" in text
    assert f"`good` is {low} to {high} %, `dim` below, `bright` above, `clipped`" in text
    assert f"{MOST_TRIALS} at most" in text
