"""Step `measure_latency`."""

from __future__ import annotations

from pathlib import Path

from tests.support.running import running, two_laser_rig, with_emulator
from tests.support.steps import parse_step, wrong_keys
from workbench.model.event import LatencyMeasured
from workbench.procedure.engine.step import COMPUTING_S, flat_placement


def test_it_needs_a_target_and_takes_no_captures() -> None:
    step = parse_step("step: measure_latency")
    assert (step.needs, step.gives, step.most_frames) == ("target", None, 20)
    assert step.captures(two_laser_rig()) == 0
    assert step.default_duration_s == COMPUTING_S


def test_the_most_frames_are_from_0_to_50() -> None:
    for frames in ("-1", "51", "many"):
        assert wrong_keys(f"step: measure_latency, most_frames: {frames}") == ["steps[0].most_frames"]
    assert wrong_keys("step: measure_latency, most_frames: 50") == []


def test_it_measures_the_latency_of_the_stream(tmp_path: Path) -> None:
    with running(tmp_path, with_emulator(two_laser_rig(), camera={"latency_frames": 1})) as session:
        session.context.bench.target.place(flat_placement("p.1", 500.0))
        assert (
            parse_step("step: measure_latency, most_frames: 4").run(session.context, "p.2").startswith("1 ")
        )
        assert session.events[-1] == LatencyMeasured(frames=1)
