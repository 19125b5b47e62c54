"""Operators that answer prompts from a file or not at all; `cli` and `emulator` have further ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path
from typing import Annotated

from pydantic import BeforeValidator, RootModel, ValidationError

from workbench.devices.protocols import Bench, Operator
from workbench.model.errors import AnswerNeededError, BadInputError
from workbench.model.problems import one_of
from workbench.model.prompt import Answer, Prompt, Quantity
from workbench.model.yamlfile import Mistake, kind_of, line_of, read_document, refuse

GIVEN = "true, a number, a choice, or {action: skip, reason: ...}"
"""Accepted forms of an answer in an answers file."""


def _in_full(given: object) -> object:
    """Mapping of an answer that is given as a number, a choice or `true`."""
    if isinstance(given, dict | Answer):
        return given
    if given is True:
        return {}
    if given is None or isinstance(given, bool) or not isinstance(given, int | float | str | date):
        raise ValueError(f"expected {GIVEN}")
    return {"value": str(given) if isinstance(given, date) else given}


class _Answers(RootModel[dict[str, Annotated[Answer, BeforeValidator(_in_full)]]]):
    """Answers file: prompt keys, each with a number, a choice, `true`, or a mapping."""


@dataclass(frozen=True)
class NoOperator:
    """Absent operator: every prompt stays open."""

    why: str

    def ask(self, prompt: Prompt) -> Answer:
        """Refuse a prompt.

        Raises:
            AnswerNeededError: always.
        """
        raise AnswerNeededError(
            f"prompt {prompt.key}: {prompt.do} -- no operator: {self.why}; run the command at a terminal"
            + ("" if prompt.at_bench else f", or use --answers with a file that contains `{prompt.key}: ...`")
        )


@dataclass(frozen=True)
class ScriptedOperator:
    """Operator that answers from a file and passes other prompts on to `other`."""

    path: Path
    answers: dict[str, Answer]
    other: Operator
    at_bench: bool = False
    """Whether the file may answer prompts that need a person at the bench, as on a virtual bench."""

    @classmethod
    def load(cls, path: Path, prompts: Mapping[str, Prompt], other: Operator) -> ScriptedOperator:
        """Read an answers file and check it against the possible prompts.

        Raises:
            BadInputError: the file cannot be read, or contains answers to unknown prompts or answers that are
                not valid; one line for each mistake, with file and line.
        """
        document = read_document(path)
        if not isinstance(document.data, dict) or "steps" in document.data or "rig" in document.data:
            got = kind_of(document.data)
            raise BadInputError(f"{path}:1: expected answers to prompts by their keys, got {got}")
        unknown = {line_of(document.data, (key,)) for key in document.data if key not in prompts}
        malformed = [one for one in document.mistakes(_Answers) if one.line not in unknown]
        mistakes = [*document.doubled, *malformed]
        answers: dict[str, Answer] = {}
        for key, given in document.data.items():
            if key not in prompts:
                wrong: str | None = f"no such prompt; {one_of(str(key), list(prompts))}"
            elif (answer := _read(key, given)) is None:
                continue
            else:
                answers[key] = _fitted(prompts[key], answer)
                wrong = _refuse(prompts[key], answers[key])
            if wrong is not None:
                mistakes.append(Mistake(line_of(document.data, (key,)), f"{key}: {wrong}"))
        refuse(path, mistakes)
        return cls(path, answers, other)

    def ask(self, prompt: Prompt) -> Answer:
        """Answer from the file, else from `other`.

        Raises:
            AnswerNeededError: neither has an answer.
        """
        if prompt.key in self.answers and (self.at_bench or not prompt.at_bench):
            return self.answers[prompt.key]
        try:
            return self.other.ask(prompt)
        except AnswerNeededError as error:
            why = (
                f"the answer in {self.path} is not used: on a real rig a person at the bench must answer"
                if prompt.key in self.answers
                else f"{self.path} has no answer to this prompt"
            )
            raise AnswerNeededError(f"{error}; {why}") from None


def _read(key: str, given: object) -> Answer | None:
    """One answer; None for a malformed one, which the check against the schema reports."""
    try:
        answer = _Answers.model_validate({key: given}).root[key]
    except ValidationError:
        return None
    return answer.model_copy(update={"by": "answers file"})


def _fitted(prompt: Prompt, answer: Answer) -> Answer:
    """Answer converted like typed input: `yes` confirms, `true` is the default value, `21.5 C` a number."""
    value: float | str | None = answer.value
    if answer.action != "done":
        return answer
    if prompt.quantity is not None:
        value = _number(value, prompt.quantity)
    elif prompt.choices:
        value = f"{value:g}" if isinstance(value, float) else value
    elif isinstance(value, str) and value.lower() == "yes":
        value = None
    return answer.model_copy(update={"value": value})


def _number(value: float | str | None, quantity: Quantity) -> float | str | None:
    if value is None:
        return quantity.usual
    try:
        return float(value.removesuffix(quantity.unit)) if isinstance(value, str) else value
    except ValueError:
        return value


def _refuse(prompt: Prompt, answer: Answer) -> str | None:
    if answer.action == "redo":
        return "expected an answer, got redo: repeated from a file it would never end"
    return prompt.refuse(answer)


def operator_of_bench(bench: Bench, given: Operator) -> Operator:
    """Operator for a bench: an answers file first, then the bench's own operator, else the given one."""
    if bench.operator is None:
        return given
    return (
        replace(given, other=bench.operator, at_bench=True)
        if isinstance(given, ScriptedOperator)
        else bench.operator
    )
