"""Questions at the terminal."""

from __future__ import annotations

import io
from collections.abc import Mapping

import pytest

from workbench.cli.dialogue import Question, ask_all, is_interactive
from workbench.model.errors import AnswerNeededError


def number(text: str, _: Mapping[str, str]) -> object:
    return float(text)


def larger(text: str, given: Mapping[str, str]) -> object:
    if float(text) <= float(given["a"]):
        raise ValueError("expected more than a")
    return text


QUESTIONS = [Question("a", "A?", "a number", number), Question("b", "B?", "more", larger, default="100")]


def answers(monkeypatch: pytest.MonkeyPatch, *lines: str) -> dict[str, str]:
    monkeypatch.setattr("sys.stdin", io.StringIO("".join(f"{line}\n" for line in lines)))
    monkeypatch.setenv("COLUMNS", "80")
    return ask_all(QUESTIONS)


def test_a_wrong_answer_is_refused_with_its_reason_and_asked_again(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert answers(monkeypatch, "one", "1", "0", "2") == {"a": "1", "b": "2"}
    assert capsys.readouterr().err.count("expected more than a") == 1


def test_enter_is_the_default(monkeypatch: pytest.MonkeyPatch) -> None:
    assert answers(monkeypatch, "", "1", "") == {"a": "1", "b": "100"}


def test_back_returns_and_keeps_the_answer_as_default(monkeypatch: pytest.MonkeyPatch) -> None:
    assert answers(monkeypatch, "back", "1", "back", "", "2") == {"a": "1", "b": "2"}
    assert answers(monkeypatch, "1", "back", "5", "6") == {"a": "5", "b": "6"}


def test_an_answer_is_repeated_with_its_unit_where_it_has_none(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    question = Question("c", "C?", "a length", lambda text, _: text, echo=lambda _: "1 mm")
    for typed, repeated in (("1", 1), ("1 mm", 0)):
        monkeypatch.setattr("sys.stdin", io.StringIO(f"{typed}\n"))
        assert ask_all([question]) == {"c": typed}
        assert capsys.readouterr().err.count("1 mm") == repeated


def test_the_end_of_the_input_is_no_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(AnswerNeededError, match="B\\?"):
        answers(monkeypatch, "1")


@pytest.mark.parametrize(("ci", "terminal"), [("1", True), ("", False)])
def test_no_person_is_asked_without_a_terminal_or_on_ci(
    monkeypatch: pytest.MonkeyPatch, ci: str, terminal: bool
) -> None:
    monkeypatch.setenv("CI", ci)
    for stream in ("stdin", "stderr"):
        monkeypatch.setattr(f"sys.{stream}.isatty", lambda: terminal, raising=False)
    assert not is_interactive()
    monkeypatch.setenv("CI", "")
    assert is_interactive() is terminal
