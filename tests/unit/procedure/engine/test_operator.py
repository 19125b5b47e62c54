"""Operators: none, and answers from a file."""

from __future__ import annotations

from pathlib import Path

import pytest

from workbench.model.errors import AnswerNeededError, BadInputError
from workbench.model.prompt import Answer, Prompt, Quantity
from workbench.procedure.engine.operator import NoOperator, ScriptedOperator

NUMBER = Prompt("p", "Read it.", quantity=Quantity("mm", 450.0, 550.0, 500.0), may={"skip": "leave it out"})
CONFIRM = Prompt("safety", "Safe?", at_bench=True)


def test_without_an_operator_the_error_names_the_prompt() -> None:
    with pytest.raises(AnswerNeededError, match=r"prompt p: ") as caught:
        NoOperator("no terminal").ask(NUMBER)
    assert caught.value.exit_code == 6


def by_key(*prompts: Prompt) -> dict[str, Prompt]:
    return {prompt.key: prompt for prompt in prompts}


def test_an_answers_file_answers_what_needs_no_person_at_the_bench(tmp_path: Path) -> None:
    path = tmp_path / "answers.yaml"
    path.write_text("p: 502\nsafety: true\nq: {action: skip, reason: no room}\n")
    skipped = Prompt("q", "Place it.", may={"skip": "leave it out"})
    script = ScriptedOperator.load(path, by_key(NUMBER, CONFIRM, skipped), NoOperator("no terminal"))
    assert script.ask(NUMBER) == Answer(value=502.0, by="answers file")
    answer = script.ask(skipped)
    assert (answer.action, answer.reason, answer.by) == ("skip", "no room", "answers file")
    for prompt in (CONFIRM, Prompt("other", "?")):
        with pytest.raises(AnswerNeededError, match=rf"prompt {prompt.key}: .*answers\.yaml"):
            script.ask(prompt)


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
def test_an_answer_in_a_file_is_converted_like_typed_input(
    tmp_path: Path, prompt: Prompt, given: str, value: float | str | None
) -> None:
    path = tmp_path / "answers.yaml"
    path.write_text(f"{prompt.key}: {given}\n")
    script = ScriptedOperator.load(path, by_key(prompt), NoOperator("no terminal"))
    assert script.answers == {prompt.key: Answer(value=value, by="answers file")}


@pytest.mark.parametrize(
    ("prompt", "given", "key"),
    [
        (PLACE, "half a metre", "p"),
        (PLACE, "5020", "p"),
        (PLACE, ".nan", "p"),
        (BARE, "true", "p"),
        (PLACE, "[500]", "p"),
        (PLACE, "", "p"),
        (PLACE, "{action: skip}", "p"),
        (PLACE, "{action: skp}", "p.action"),
        (PLACE, "{acton: skip}", "p.acton"),
        (PLACE, "{action: redo, reason: slipped}", "p"),
        (CHOICE, "green", "card"),
        (CONFIRM, "false", "safety"),
        (CONFIRM, "no", "safety"),
    ],
)
def test_an_answer_that_is_not_valid_is_reported_with_its_line(
    tmp_path: Path, prompt: Prompt, given: str, key: str
) -> None:
    path = tmp_path / "answers.yaml"
    path.write_text(f"# a comment\n{prompt.key}: {given}\n")
    with pytest.raises(BadInputError) as caught:
        ScriptedOperator.load(path, by_key(prompt), NoOperator("no terminal"))
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{path}:2: {key}: ")


@pytest.mark.parametrize("text", ["- 1", "procedure: p\nsteps: []", "rig: r"])
def test_a_file_of_another_kind_is_no_answers_file(tmp_path: Path, text: str) -> None:
    path = tmp_path / "answers.yaml"
    path.write_text(text)
    with pytest.raises(BadInputError, match=r"answers\.yaml:1: "):
        ScriptedOperator.load(path, by_key(PLACE), NoOperator("no terminal"))


def test_answers_to_unknown_prompts_are_reported_with_the_nearest_key(tmp_path: Path) -> None:
    path = tmp_path / "answers.yaml"
    path.write_text("card: green\nsafty: true\np: 500\nsafety: true\np: 510\n7: [1]\n")
    with pytest.raises(BadInputError) as caught:
        ScriptedOperator.load(path, by_key(PLACE, CHOICE, CONFIRM), NoOperator("no terminal"))
    lines = str(caught.value).replace(f"{path}:", "").splitlines()
    assert [line.split(": ")[:2] for line in lines] == [["1", "card"], ["2", "safty"], ["5", "p"], ["6", "7"]]
    assert "safety, p, card" in lines[1]
