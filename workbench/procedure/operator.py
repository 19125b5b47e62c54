"""Who answers a procedure's questions: see also the person in `cli` and the emulated bench."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from pydantic import RootModel

from workbench.devices.protocols import Bench, Operator
from workbench.model.errors import AnswerNeededError, BadInputError
from workbench.model.prompt import Answer, Prompt
from workbench.model.yamlfile import load_yaml_model


class _Answers(RootModel[dict[str, Answer | float | str | bool]]):
    """An answers file: prompt keys, each with a number, a choice, `yes`, or an answer in full."""


@dataclass(frozen=True)
class Nobody:
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
class Scripted:
    """Answers out of a file; what the file does not answer goes to `other`."""

    path: Path
    answers: dict[str, Answer]
    other: Operator
    at_bench: bool = False
    """Whether nobody can be hurt: on a virtual bench the file may say where the target stands."""

    @classmethod
    def load(cls, path: Path, other: Operator) -> Scripted:
        """Read the file.

        Raises:
            BadInputError: see `load_yaml_model`.
        """
        given = load_yaml_model(path, _Answers).root
        return cls(path, {key: _answer(value) for key, value in given.items()}, other)

    def ask(self, prompt: Prompt) -> Answer:
        """The file's answer.

        Raises:
            BadInputError: it does not fit the question.
            AnswerNeededError: as `other` does.
        """
        if prompt.key not in self.answers or (prompt.at_bench and not self.at_bench):
            try:
                return self.other.ask(prompt)
            except AnswerNeededError as error:
                raise AnswerNeededError(f"{error}; {self.path} answers {', '.join(self.answers)}") from None
        answer = self.answers[prompt.key]
        if (wrong := prompt.refuse(answer)) is not None:
            raise BadInputError(f"{self.path}: {prompt.key}: {wrong}")
        return answer


def _answer(given: Answer | float | str | bool) -> Answer:
    if isinstance(given, Answer):
        return given.model_copy(update={"by": "answers file"})
    value = None if given is True else float(given) if isinstance(given, int | float) else given
    return Answer(value=value, by="answers file")


def who_answers(bench: Bench, given: Operator) -> Operator:
    """The bench's own operator where it has one, but an answers file comes first."""
    if bench.operator is None:
        return given
    return (
        replace(given, other=bench.operator, at_bench=True) if isinstance(given, Scripted) else bench.operator
    )
