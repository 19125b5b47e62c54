"""Step `thesis_simulation`."""

from __future__ import annotations

from pathlib import Path

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
