"""Operators: nobody, and answers out of a file."""

from __future__ import annotations

from pathlib import Path

import pytest

from workbench.model.errors import AnswerNeededError, BadInputError
from workbench.model.prompt import Answer, Prompt, Quantity
from workbench.procedure.engine.operator import NoOperator, ScriptedOperator

NUMBER = Prompt("p", "Read it.", quantity=Quantity("mm", 450.0, 550.0, 500.0), may={"skip": "leave it out"})
CONFIRM = Prompt("safety", "Safe?", at_bench=True)


def test_nobody_names_the_prompt() -> None:
    with pytest.raises(AnswerNeededError, match=r"prompt p: Read it.*no terminal") as caught:
        NoOperator("no terminal").ask(NUMBER)
    assert caught.value.exit_code == 6


def by_key(*prompts: Prompt) -> dict[str, Prompt]:
    return {prompt.key: prompt for prompt in prompts}


def test_an_answers_file(tmp_path: Path) -> None:
    path = tmp_path / "answers.yaml"
    path.write_text("p: 502\nsafety: true\nq: {action: skip, reason: no room}\n")
    skipped = Prompt("q", "Place it.", may={"skip": "leave it out"})
    script = ScriptedOperator.load(path, by_key(NUMBER, CONFIRM, skipped), NoOperator("no terminal"))
    assert script.ask(NUMBER) == Answer(value=502.0, by="answers file")
    answer = script.ask(skipped)
    assert (answer.action, answer.reason, answer.by) == ("skip", "no room", "answers file")
    with pytest.raises(
        AnswerNeededError, match=r"prompt safety.*answers it, but on a real rig only somebody"
    ):
        script.ask(CONFIRM)  # it says yes, but has no eyes
    with pytest.raises(AnswerNeededError, match=r"prompt other.*answers.yaml has no answer to it"):
        script.ask(Prompt("other", "?"))


CHOICE = Prompt("card", "Which card?", choices=("1", "yes"))
PLACE = Prompt(
    "p",
    "Place it.",
    quantity=Quantity("mm", 450.0, 550.0, 500.0),
    may={"redo": "again", "skip": "leave it out"},
)
BARE = Prompt(
    "p", "Place it.", quantity=Quantity("mm", 450.0, 550.0), may={"redo": "again", "skip": "leave it out"}
)


@pytest.mark.parametrize(
    ("prompt", "given", "value"),
    [
        (CONFIRM, "true", None),
        (CONFIRM, "yes", None),
        (CHOICE, "yes", "yes"),
        (CHOICE, "1", "1"),
        (PLACE, "true", 500.0),
        (PLACE, "502.5 mm", 502.5),
        (PLACE, "{value: 502}", 502.0),
    ],
)
def test_a_files_answer_is_taken_as_a_persons_would_be(
    tmp_path: Path, prompt: Prompt, given: str, value: float | str | None
) -> None:
    path = tmp_path / "answers.yaml"
    path.write_text(f"{prompt.key}: {given}\n")
    script = ScriptedOperator.load(path, by_key(prompt), NoOperator("no terminal"))
    assert script.answers == {prompt.key: Answer(value=value, by="answers file")}


@pytest.mark.parametrize(
    ("prompt", "given", "says"),
    [
        (PLACE, "half a metre", "expected 450 to 550 mm, got half a metre"),
        (PLACE, "5020", "expected 450 to 550 mm, got 5020.0"),
        (PLACE, ".nan", "expected a finite number"),
        (BARE, "true", "expected 450 to 550 mm, got None"),
        (PLACE, "[500]", "expected true, a number, a choice, or {action: skip, reason: ...}, got [500]"),
        (PLACE, "", "expected true, a number, a choice, or {action: skip, reason: ...}, got nothing"),
        (PLACE, "{action: skip}", "skip loses data: expected a reason with it"),
        (PLACE, "{action: skp}", "expected 'done', 'redo', 'skip' or 'abort', got 'skp'"),
        (PLACE, "{acton: skip}", "no such key; expected one of action, value"),
        (PLACE, "{action: redo, reason: slipped}", "got redo: asked again, the file would say it again"),
        (CHOICE, "green", "expected one of 1, yes, got green"),
        (CONFIRM, "false", "expected true, a number, a choice, or"),
        (CONFIRM, "no", "expected yes, got no"),
    ],
)
def test_an_answer_that_cannot_fit_is_told_with_its_line(
    tmp_path: Path, prompt: Prompt, given: str, says: str
) -> None:
    path = tmp_path / "answers.yaml"
    path.write_text(f"# ours\n{prompt.key}: {given}\n")
    with pytest.raises(BadInputError) as caught:
        ScriptedOperator.load(path, by_key(prompt), NoOperator("no terminal"))
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{path}:2: {prompt.key}")
    assert says in line


@pytest.mark.parametrize(
    ("text", "came"), [("- 1", "no mapping"), ("procedure: p\nsteps: []", "a procedure"), ("rig: r", "a rig")]
)
def test_a_file_of_another_kind_is_no_answers_file(tmp_path: Path, text: str, came: str) -> None:
    path = tmp_path / "answers.yaml"
    path.write_text(text)
    with pytest.raises(BadInputError, match=f":1: expected answers to prompts by their keys, got {came}"):
        ScriptedOperator.load(path, by_key(PLACE), NoOperator("no terminal"))


def test_answers_that_nobody_asks_for_are_told_with_the_nearest_key(tmp_path: Path) -> None:
    path = tmp_path / "answers.yaml"
    path.write_text("card: green\nsafty: true\np: 500\nsafety: true\np: 510\n7: [1]\n")
    with pytest.raises(BadInputError) as caught:
        ScriptedOperator.load(path, by_key(PLACE, CHOICE, CONFIRM), NoOperator("no terminal"))
    lines = str(caught.value).replace(f"{path}:", "").splitlines()
    assert [line.split(":")[0] for line in lines] == ["1", "2", "5", "6"]
    assert lines[1] == "2: safty: nothing of this name is asked; expected one of safety, p, card"
    assert lines[2] == "5: p: stands here again, after line 3; leave one of them"
