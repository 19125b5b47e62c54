"""Step `thesis_simulation`."""

from __future__ import annotations

from pathlib import Path

from tests.support.running import two_laser_rig
from tests.support.steps import parse_step, wrong_keys
from workbench.procedure.engine.procedure_file import load_procedure
from workbench.trials.thesis import ThesisSimulationStep

ROOT = Path(__file__).parents[4]


def test_the_procedure_has_every_shape_seen_in_part_and_not_at_all_on_both_lines() -> None:
    (step,) = load_procedure(ROOT / "procedures/thesis-simulation.yaml").steps
    assert isinstance(step, ThesisSimulationStep)
    lost = {0: "all", 1: "some", 3: "some", 4: "none"}
    have = {(s.lines, s.shape.split()[0], lost[len(s.lost)]) for s in step.scenes}
    for line in ("horizontal", "vertical"):
        for shape in ("flat", "incline", "round"):
            assert {((line,), shape, seen) for seen in ("all", "some", "none")} <= have


SCENE = "{name: %s, source: s, set_mm: [100, 500], claims: [{quantity: range}]}"


def test_scenes_have_names_that_differ() -> None:
    one = SCENE % "a"
    assert wrong_keys(f"step: thesis_simulation, points: 5, scenes: [{one}, {one}]") == ["steps[0]"]
    assert wrong_keys("step: thesis_simulation, points: 1, scenes: []") == [
        "steps[0].points",
        "steps[0].scenes",
    ]


def test_it_needs_nothing_of_the_bench() -> None:
    step, rig = parse_step(f"step: thesis_simulation, points: 5, scenes: [{SCENE % 'a'}]"), two_laser_rig()
    assert (step.needs, step.gives) == (None, None)
    assert step.captures(rig) == 0
    assert list(step.placements("p.1", rig)) == []
    assert list(step.prompts("p.1", rig)) == []
