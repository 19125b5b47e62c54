"""Latency of a camera's stream, counted in frames."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.plain_bench import plain_bench
from tests.support.running import two_laser_rig, with_emulator
from workbench.devices.protocols import Bench, StreamingCamera
from workbench.model.errors import RigNotReadyError
from workbench.model.target import NoTarget, Placement
from workbench.procedure.capture.latency import count_latency


def count(bench: Bench, most_frames: int, placement: Placement) -> int:
    camera = bench.camera
    assert isinstance(camera, StreamingCamera)
    camera.discard_frames = 0
    bench.target.place(placement)
    return count_latency(bench.lasers, camera, two_laser_rig(), most_frames)


@pytest.mark.parametrize("frames", [0, 1, 3])
def test_frames_are_counted_to_the_first_that_shows_the_laser(tmp_path: Path, frames: int) -> None:
    rig = with_emulator(two_laser_rig(), camera={"latency_frames": frames})
    with plain_bench(rig, tmp_path) as bench:
        assert count(bench, 5, Placement(key="p", standoff_mm=500.0)) == frames
        assert bench.lasers.state().lit == ()


def test_more_frames_than_allowed_are_not_counted(tmp_path: Path) -> None:
    rig = with_emulator(two_laser_rig(), camera={"latency_frames": 3})
    with plain_bench(rig, tmp_path) as bench, pytest.raises(RigNotReadyError, match="L1") as caught:
        count(bench, 2, Placement(key="p", standoff_mm=500.0))
    assert caught.value.exit_code == 4


def test_a_laser_that_shines_on_nothing_has_no_latency(tmp_path: Path) -> None:
    nothing = Placement(key="p", standoff_mm=500.0, target=NoTarget())
    with plain_bench(two_laser_rig(), tmp_path) as bench:
        with pytest.raises(RigNotReadyError, match="L1"):
            count(bench, 1, nothing)
        assert bench.lasers.state().lit == ()
