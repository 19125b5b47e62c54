"""What is about to run: order of steps, counts, prompts, names of sessions."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import pytest

from tests.support.procedures import RIG, plan_of
from workbench.model.errors import BadInputError
from workbench.model.prior import Prior
from workbench.model.rig import Rig
from workbench.model.target import Placement
from workbench.procedure.engine.context import Context
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.registry import register
from workbench.procedure.engine.step import StepModel, flat_placement

CAPTURE = "  - {step: capture_grid, standoffs_mm: [300, 600], repeats: 2}\n"
TRIAL = "  - {step: accuracy_trial, standoffs_mm: [450], readings: 5}\n"


def test_steps_are_numbered_within_their_procedure_with_placements_and_captures(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, a=CAPTURE + "  - {step: fit}\n  - {step: export}\n", b=TRIAL)
    counted = [(s.procedure, s.index, s.placements, s.captures) for s in plan.steps()]
    assert counted == [("a", 1, 2, 2 * 2 * 4), ("a", 2, 0, 0), ("a", 3, 0, 0), ("b", 1, 1, 5)]
    assert [step.default_duration_s for step in plan.steps()][1:3] == [10.0, 1.0]


def test_a_step_finds_what_an_earlier_procedure_gives(tmp_path: Path) -> None:
    calibrate = CAPTURE + "  - {step: fit}\n  - {step: export}\n"
    with pytest.raises(BadInputError, match=r"b\.yaml: steps\[0\]: accuracy_trial .*calibration") as caught:
        plan_of(tmp_path, b=TRIAL, a=calibrate)
    assert caught.value.exit_code == 2
    with pytest.raises(BadInputError, match=r"a\.yaml: steps\[1\]: export .*fit"):
        plan_of(tmp_path, a=CAPTURE + "  - {step: export}\n")
    assert len(plan_of(tmp_path, a=calibrate, b=TRIAL).procedures) == 2


def test_beams_whose_spots_cannot_be_assigned_are_refused_before_the_session(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, a=CAPTURE)
    beams = tuple(
        laser.model_copy(update={"emitter": "g", "tx": Prior(value=-laser.x_mm.value / 1000, sd=0.0)})
        for laser in plan.rig.lasers
    )
    rig = plan.rig.model_copy(update={"lasers": beams})
    with pytest.raises(BadInputError, match="emitter g that do not cross within 100 to 5000 mm"):
        Plan.of(rig, plan.rig_path, plan.procedures, plan.procedure_paths)


@register
class TwicePlacedStep(StepModel):
    """Two placements under one key: the captures of one would pass for those of the other."""

    step: Literal["twice_placed"]

    @property
    def title(self) -> str:
        return "Twice"

    def placements(self, name: str, rig: Rig) -> Sequence[Placement]:
        return [flat_placement(name, 800.0), flat_placement(name, 800.0)]

    def run(self, context: Context, name: str) -> str:
        return "never"


def test_placements_of_one_key_are_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"a\.yaml: steps\[1\]: twice_placed: .*800mm") as caught:
        plan_of(tmp_path, a=CAPTURE + "  - {step: twice_placed}\n")
    assert caught.value.exit_code == 2


def test_two_procedures_of_one_name_are_refused(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, a=CAPTURE)
    path = tmp_path / "a.yaml"
    with pytest.raises(BadInputError, match=r"a\.yaml: procedure"):
        Plan.of(plan.rig, RIG, plan.procedures * 2, [path, path])


def test_prompts_are_keyed_in_the_order_in_which_they_come(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, a="  - {step: confirm, text: Open it.}\n" + CAPTURE)
    assert list(plan.prompts())[:4] == ["safety", "a.1", "a.2/300mm", "a.2/600mm"]
    assert all(key == prompt.key for key, prompt in plan.prompts().items())


def test_prompts_of_added_placements_are_those_of_the_last_grid_before_the_fit(tmp_path: Path) -> None:
    fit = "  - {step: fit}\n"
    plan = plan_of(tmp_path, a=CAPTURE + CAPTURE.replace("300, 600", "400") + fit + CAPTURE)
    added = [key for key in plan.prompts((900.0, 400.0)) if key not in plan.prompts()]
    assert added == ["a.2/900mm", "a.2/02-400mm", "a.2/900mm/standoff", "a.2/02-400mm/standoff"]


def test_a_session_whose_name_is_taken_gets_a_number(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, a=CAPTURE)
    first = plan.new_session(tmp_path)
    assert re.fullmatch(r"\d{8}-\d{6}-a", first.name)
    names = set()
    for _ in range(3):
        folder = plan.new_session(tmp_path)
        folder.mkdir()
        names.add(folder.name)
    assert len(names) == 3
