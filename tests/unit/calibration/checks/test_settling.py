"""Time constant of a drift, on simulated residuals of a fit: bias, coverage, false statements."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.support.rigs import World, thesis_rig
from workbench.calibration.checks.settling import (
    DriftProfile,
    Settling,
    drift_advice,
    drifts_within_parts,
    settling_of,
)
from workbench.calibration.estimation.fit import CalibrationFit, fit
from workbench.calibration.selection.drift import with_drift
from workbench.model.arrays import FloatArray
from workbench.procedure.engine.visiting_order import shuffled

RUNS = 60
RIG = thesis_rig(0.05, 0.048)


def fitted(u_px: float, time_constant: float) -> CalibrationFit:
    """Fit with a drift of a session in shuffled order whose image settles by `u_px`."""
    seen = World(RIG, 1).observations()
    order = shuffled(tuple({s.standoff_mm for s in seen}))
    seen = sorted(seen, key=lambda s: order.index(s.standoff_mm))
    shifts = u_px * np.exp(-np.linspace(0, 1, len(seen)) / time_constant)
    moved = [replace(s, u_px=s.u_px + shift) for s, shift in zip(seen, shifts.tolist(), strict=True)]
    return fit(with_drift(RIG), moved)


@cache
def steady() -> DriftProfile:
    return DriftProfile.of(fitted(0.0, 1.0))


def drawn(shape: FloatArray, u_px: float, profile: DriftProfile | None = None) -> list[Settling | None]:
    """Settling of simulated residuals: noise, parameters drawn from their priors, a drift in u and v."""
    random, profile = np.random.default_rng(3), profile or steady()
    measured = (profile.inverse_sd > 0).ravel()
    shift = (profile.inverse_sd * shape[:, None] * [u_px, -u_px / 2]).ravel()
    found = []
    for _ in range(RUNS):
        noise = random.standard_normal(len(shift)) * measured
        parameters = profile.jacobian @ random.standard_normal(profile.jacobian.shape[1])
        found.append(settling_of(replace(profile, residual=noise + parameters - shift)))
    return found


@pytest.mark.parametrize("time_constant", [0.1, 0.25])
def test_the_time_constant_is_unbiased_and_its_interval_covers(time_constant: float) -> None:
    """Of 60 intervals with 95 %, 52 or fewer cover with a probability of 4e-3."""
    found = [one for one in drawn(np.exp(-steady().time / time_constant), 1.0) if one is not None]
    assert len(found) == RUNS
    ratio = np.log([one.time_constant / time_constant for one in found])
    assert abs(ratio.mean()) < 4 * ratio.std() / RUNS**0.5 + 0.01
    grid = 1.03
    inside = [one.interval[0] / grid <= time_constant <= one.interval[1] * grid for one in found]
    assert sum(inside) > 52
    warm_up = time_constant * np.log(np.hypot(1.0, 0.5) / 0.05)
    assert np.median([one.warm_up(0.05) for one in found]) == pytest.approx(warm_up, rel=0.1)


@pytest.mark.parametrize("u_px", [0.0, 0.5])
def test_a_steady_drift_has_no_time_constant(u_px: float) -> None:
    """Of 60 at 1 %, more than 3 occur with a probability of 3e-3."""
    assert sum(one is not None for one in drawn(1.0 - steady().time, u_px)) <= 3


def test_a_shift_below_the_limit_needs_no_warm_up() -> None:
    assert Settling(0.2, (0.1, 0.3), 0.04).warm_up(0.05) == 0.0


def test_the_advice_of_a_session_follows_from_its_own_settling() -> None:
    settles, still = drift_advice(fitted(1.0, 0.15)), drift_advice(fitted(0.0, 1.0))
    assert "times the duration of this session" in settles
    assert settles != still


@cache
def interrupted() -> DriftProfile:
    """Profile of a session whose second half was captured after an interruption."""
    seen = World(RIG, 1).observations()
    order = shuffled(tuple({s.standoff_mm for s in seen}))
    seen = sorted(seen, key=lambda s: order.index(s.standoff_mm))
    half = len(seen) // 2
    return DriftProfile.of(
        fit(
            with_drift(RIG),
            [replace(s, time_s=float(n), part="1" if n >= half else "") for n, s in enumerate(seen)],
        )
    )


@pytest.mark.thorough
def test_each_part_settles_anew_with_its_own_amplitude() -> None:
    """Intervals as above; a shift by 1 px when cold, and by 0.5 px after the interruption."""
    profile, time_constant = interrupted(), 0.1
    amplitude = profile.parts @ [1.0, 0.5]
    found = drawn(amplitude * np.exp(-profile.time / time_constant), 1.0, profile)
    known = [one for one in found if one is not None]
    assert len(known) >= RUNS - 3
    inside = [one.interval[0] / 1.03 <= time_constant <= one.interval[1] * 1.03 for one in known]
    assert sum(inside) > 49
    assert np.median([one.time_constant for one in known]) == pytest.approx(time_constant, rel=0.15)


def test_a_steady_drift_of_each_part_has_no_time_constant() -> None:
    profile = interrupted()
    steady_in_parts = profile.time * (profile.parts @ [1.0, -0.6])
    assert sum(one is not None for one in drawn(steady_in_parts, 0.5, profile)) <= 3


def test_the_advice_states_times_where_the_captures_have_them() -> None:
    whole = fitted(1.0, 0.15)
    by_time = replace(whole, cells=replace(whole.cells, times=replace(whole.cells.times, duration_s=4000.0)))
    assert " min" in drift_advice(by_time)
    assert " min" not in drift_advice(whole)


def stepped(u_px: float, drift_px: float) -> CalibrationFit:
    """Fit of a session whose image steps at an interruption after its first half, and drifts steadily."""
    seen = World(RIG, 1).observations()
    order = shuffled(tuple({s.standoff_mm for s in seen}))
    seen = sorted(seen, key=lambda s: order.index(s.standoff_mm))
    half, count = len(seen) // 2, len(seen)
    moved = [
        replace(
            s,
            u_px=s.u_px + u_px * (n >= half) + drift_px * n / count,
            time_s=float(n),
            part="1" if n >= half else "",
        )
        for n, s in enumerate(seen)
    ]
    return fit(with_drift(RIG), moved)


@pytest.mark.parametrize("u_px", [0.8, -1.5])
def test_a_pure_step_between_parts_is_named_instead_of_a_warm_up(u_px: float) -> None:
    found = stepped(u_px, 0.0)
    assert not drifts_within_parts(DriftProfile.of(found))
    advice = drift_advice(found)
    assert "parts 1 and 2" in advice
    (stated,) = re.findall(r"step by ([-+][0-9.]+) px in u", advice)
    assert float(stated) == pytest.approx(u_px, abs=0.15)
    assert "warm" not in advice


def test_a_drift_within_the_parts_keeps_the_advice_on_warming_up() -> None:
    found = stepped(0.8, 3.0)
    assert drifts_within_parts(DriftProfile.of(found))
    assert "warm" in drift_advice(found)
