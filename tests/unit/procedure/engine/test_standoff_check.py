"""A standoff that contradicts the others is asked about while the target stands there."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.crash.short import CALLER, RESUMER, story, with_small_pictures, write_files
from workbench.model import event as ev
from workbench.model.errors import AnswerNeededError, LimitFailedError
from workbench.model.prompt import Answer, Prompt
from workbench.procedure.engine.operator import NoOperator
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.resume import resume
from workbench.procedure.engine.run import run

PROCEDURE = """\
format: 1
procedure: short
title: Short
steps:
  - step: capture_grid
    standoffs_mm: [200, 300, 450, 700]
    repeats: 2
  - step: fit
    limits: {max_relative_range_sd: 0.9}
"""
LAST, QUESTION = "short.1/700mm", "short.1/700mm/standoff"
AGAIN = Answer(action="redo", reason="the ruler was misread")


class Person:
    """Operator who enters standoffs as asked for, and answers the question about the last one."""

    def __init__(self, *answers: Answer) -> None:
        self.answers = list(answers)
        self.asked: list[str] = []

    def ask(self, prompt: Prompt) -> Answer:
        self.asked.append(prompt.key)
        if prompt.key == QUESTION:
            return self.answers.pop(0)
        return Answer(value=None if prompt.quantity is None else prompt.quantity.usual)


def begin(folder: Path, person: Person | NoOperator, error_mm: float = 25.0) -> Path:
    rig, procedure = write_files(folder, PROCEDURE)
    with_small_pictures(rig)
    truth = f"  answers: false\n  truth: {{placements: {{{LAST}: {{error_mm: {error_mm}}}}}}}\n"
    rig.write_text(f"{rig.read_text().rstrip()}\n{truth}")
    run(Plan.load(rig, [procedure]), folder / "s", [], CALLER, lambda: None, person)
    return folder / "s"


def placed(session: Path) -> list[str]:
    return [e.placement.key for e in story(session) if isinstance(e, ev.TargetPlaced)]


def test_a_sound_placement_is_not_asked_about(tmp_path: Path) -> None:
    person = Person()
    begin(tmp_path, person, error_mm=0.1)
    assert QUESTION not in person.asked


def test_measure_again_asks_for_the_standoff_again(tmp_path: Path) -> None:
    person = Person(AGAIN, Answer())
    with pytest.raises(LimitFailedError):  # the virtual bench repeats a pinned error
        begin(tmp_path, person)
    assert person.asked[-4:] == [LAST, QUESTION, LAST, QUESTION]
    assert placed(tmp_path / "s").count(LAST) == 1, "the first attempt is void"
    assert [path.name for path in (tmp_path / "s/set-aside").iterdir()] == ["1"]


def test_kept_captures_count_and_are_asked_about_once(tmp_path: Path) -> None:
    person = Person(Answer())
    with pytest.raises(LimitFailedError):  # by the fit
        begin(tmp_path, person)
    assert person.asked[-2:] == [LAST, QUESTION]
    events = story(tmp_path / "s")
    assert sum(isinstance(e, ev.CaptureTaken) for e in events) == 4 * 2 * 2
    (kept,) = [e for e in events if isinstance(e, ev.Answered) and e.key == QUESTION]
    assert kept.answer.action == "done"


def test_a_session_that_waits_for_the_answer_goes_on_with_it(tmp_path: Path) -> None:
    class Absent(Person):
        def ask(self, prompt: Prompt) -> Answer:
            if prompt.key == QUESTION:
                raise AnswerNeededError("the bench is left alone")
            return super().ask(prompt)

    with pytest.raises(AnswerNeededError):
        begin(tmp_path, Absent())
    person = Person(Answer())
    with pytest.raises(LimitFailedError):
        resume(tmp_path / "s", [], RESUMER, lambda: None, person)
    assert person.asked == ["safety", LAST, QUESTION]
    again = Person()
    with pytest.raises(LimitFailedError):
        resume(tmp_path / "s", [], RESUMER, lambda: None, again)
    assert again.asked == [], "the answer is replayed"
