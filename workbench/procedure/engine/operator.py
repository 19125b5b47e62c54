"""Who answers a procedure's questions: see also the person in `cli` and the emulated bench."""

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


def _in_full(given: object) -> object:
    """An answer as a mapping, where it was given as a number, a choice or `true`."""
    if isinstance(given, dict | Answer):
        return given
    if given is True:
        return {}
    if given is None or isinstance(given, bool) or not isinstance(given, int | float | str | date):
        raise ValueError(f"expected {GIVEN}")
    return {"value": str(given) if isinstance(given, date) else given}


class _Answers(RootModel[dict[str, Annotated[Answer, BeforeValidator(_in_full)]]]):
    """An answers file: prompt keys, each with a number, a choice, `true`, or an answer in full."""


@dataclass(frozen=True)
class NoOperator:
    """No terminal, or nobody at it: every question stays open."""

    why: str

    def ask(self, prompt: Prompt) -> Answer:
        """Raise.

        Raises:
            AnswerNeededError: always.
        """
        raise AnswerNeededError(
            f"prompt {prompt.key}: {prompt.do} -- nobody answers: {self.why}; run it at a terminal"
            + ("" if prompt.at_bench else f", or give --answers a file with `{prompt.key}: ...`")
        )


@dataclass(frozen=True)
class ScriptedOperator:
    """Answers out of a file; what the file does not answer goes to `other`."""

    path: Path
    answers: dict[str, Answer]
    other: Operator
    at_bench: bool = False
    """Whether nobody can be hurt: on a virtual bench the file may say where the target stands."""

    @classmethod
    def load(cls, path: Path, foreseen: Mapping[str, Prompt], other: Operator) -> ScriptedOperator:
        """Read the file, and hold it against the prompts that may come.

        Raises:
            BadInputError: it cannot be read, answers what nobody asks, or with what does not fit; one line
                for each mistake, with file and line.
        """
        document = read_document(path)
        if not isinstance(document.data, dict) or "steps" in document.data or "rig" in document.data:
            came = kind_of(document.data)
            raise BadInputError(f"{path}:1: expected answers to prompts by their keys, got {came}")
        strangers = {line_of(document.data, (key,)) for key in document.data if key not in foreseen}
        malformed = [one for one in document.mistakes(_Answers) if one.line not in strangers]
        mistakes = [*document.doubled, *malformed]
        answers: dict[str, Answer] = {}
        for key, given in document.data.items():
            if key not in foreseen:
                wrong: str | None = f"nothing of this name is asked; {one_of(str(key), list(foreseen))}"
            elif (answer := _read(key, given)) is None:
                continue
            else:
                answers[key] = _fitted(foreseen[key], answer)
                wrong = _refuse(foreseen[key], answers[key])
            if wrong is not None:
                mistakes.append(Mistake(line_of(document.data, (key,)), f"{key}: {wrong}"))
        refuse(path, mistakes)
        return cls(path, answers, other)

    def ask(self, prompt: Prompt) -> Answer:
        """The file's answer.

        Raises:
            AnswerNeededError: as `other` does.
        """
        if prompt.key in self.answers and (self.at_bench or not prompt.at_bench):
            return self.answers[prompt.key]
        try:
            return self.other.ask(prompt)
        except AnswerNeededError as error:
            why = (
                f"{self.path} answers it, but on a real rig only somebody at the bench can"
                if prompt.key in self.answers
                else f"{self.path} has no answer to it"
            )
            raise AnswerNeededError(f"{error}; {why}") from None


def _read(key: str, given: object) -> Answer | None:
    """One answer; None where it is none, which the file's schema has told."""
    try:
        answer = _Answers.model_validate({key: given}).root[key]
    except ValidationError:
        return None
    return answer.model_copy(update={"by": "answers file"})


def _fitted(prompt: Prompt, answer: Answer) -> Answer:
    """The answer as a person's would be taken: `yes` confirms, `true` says as asked, 21.5 C is a number."""
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
        return "expected an answer, got redo: asked again, the file would say it again, without end"
    return prompt.refuse(answer)


def operator_of_bench(bench: Bench, given: Operator) -> Operator:
    """The bench's own operator where it has one, but an answers file comes first."""
    if bench.operator is None:
        return given
    return (
        replace(given, other=bench.operator, at_bench=True)
        if isinstance(given, ScriptedOperator)
        else bench.operator
    )
