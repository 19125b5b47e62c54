"""Simulated time: the same after a stop as without it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.virtual_bench import emulated_thesis, put, shot
from workbench.emulator import open_bench
from workbench.emulator.clock import FRAME_NS, PLACING_NS, SETTLING_NS, SimulatedClock


def test_a_frame_takes_its_period_or_its_exposure() -> None:
    clock = SimulatedClock()
    clock.expose(0.001)
    assert clock.now_ns() == FRAME_NS
    clock.expose(0.5)
    assert clock.now_ns() == FRAME_NS + 500_000_000


def test_a_placement_follows_the_last_capture_that_counts() -> None:
    clock = SimulatedClock()
    clock.continue_after(7)
    clock.switch()
    clock.continue_after(9)
    assert clock.now_ns() == 9 + PLACING_NS


def test_a_capture_that_is_taken_again_takes_its_time_once() -> None:
    clock = SimulatedClock()
    clock.switch()
    clock.expose(0.0)
    clock.switch(again=True)
    assert clock.now_ns() == SETTLING_NS
    clock.continue_after(9)
    clock.switch(again=True)
    assert clock.now_ns() == 9 + PLACING_NS + SETTLING_NS


@pytest.mark.parametrize("stale", [0, 3])
def test_captures_advance_the_clock_of_the_bench(tmp_path: Path, stale: int) -> None:
    """A frame and those that are discarded before it, as stale as the camera's latency."""
    rig = emulated_thesis(camera={"latency_frames": stale})
    with open_bench(rig, tmp_path / "s") as bench:
        put(bench, 500.0)
        began_ns = bench.clock.now_ns()
        shot(bench, "k")
        assert bench.clock.now_ns() - began_ns == SETTLING_NS + (1 + stale) * FRAME_NS


def test_lost_frames_take_no_time(tmp_path: Path) -> None:
    with open_bench(emulated_thesis(camera={"dropped": 0.5}), tmp_path / "s") as bench:
        put(bench, 500.0)
        began_ns = bench.clock.now_ns()
        for _ in range(5):
            bench.camera.grab()
        assert bench.clock.now_ns() - began_ns == 5 * FRAME_NS


@pytest.mark.parametrize(
    ("blocks", "rests"),
    [
        ({}, True),
        ({"drift": {"v_px_per_frame": 1e-3}}, False),
        ({"warm_up": {"f_relative": 1e-3}}, False),
    ],
)
def test_a_bench_that_drifts_is_cold_after_an_interruption(
    tmp_path: Path, blocks: dict[str, object], rests: bool
) -> None:
    with open_bench(emulated_thesis(**blocks), tmp_path / "s") as bench:
        assert bench.rests == rests
