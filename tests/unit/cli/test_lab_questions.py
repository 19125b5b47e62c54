"""Questions about the laboratory: asked once in a terminal, never without one."""

from __future__ import annotations

import io
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import pytest

from tests.support.reference_session import record
from workbench.cli.lab_questions import QUESTIONS, laboratory_of
from workbench.model.errors import AnswerNeededError
from workbench.model.laboratory import Laboratory
from workbench.report.certificate.dcc import required_parties

ANSWERS = {
    "laboratory.name": "Lab: the <b>best</b>",
    "standard.name": "steel rule",
    "standard.calibrated": "2026-05-04",
    "standard.uncertainty_mm": "0,1",
    "temperature.low": "22",
    "temperature.high": "20",
}
Type = Callable[..., io.StringIO]


class Keyboard(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def keyboard(monkeypatch: pytest.MonkeyPatch) -> Type:
    """What a person types: lines by the question's key; Enter alone for the others."""
    monkeypatch.delenv("CI", raising=False)
    monkeypatch.setenv("COLUMNS", "80")

    def types(answers: Mapping[str, str | Sequence[str]]) -> Keyboard:
        lines = list[str]()
        for question in QUESTIONS:
            answer = answers.get(question.key, "")
            lines += [answer] if isinstance(answer, str) else answer
        typed = Keyboard("".join(f"{line}\n" for line in lines))
        monkeypatch.setattr(sys, "stdin", typed)
        monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
        return typed

    return types


def test_answers_are_written_and_not_asked_for_again(keyboard: Type, tmp_path: Path) -> None:
    typed = keyboard(ANSWERS)
    lab = laboratory_of(tmp_path, False)
    assert typed.read() == ""
    assert lab.laboratory is not None
    assert lab.laboratory.name == "Lab: the <b>best</b>"
    assert (lab.customer, lab.authorised_by) == (None, "")
    assert lab.standards[0].expanded_uncertainty == 0.1
    assert lab.ambient.temperature_c == (20.0, 22.0)
    again = keyboard({"laboratory.name": "another"})
    assert laboratory_of(tmp_path, False) == lab
    assert again.tell() == 0


@pytest.mark.parametrize(
    ("key", "wrong", "right"),
    [
        ("country", "Germany", "de"),
        ("standard.calibrated", "yesterday", "2026-05-04"),
        ("standard.calibrated", "4 May", "2026-05-04"),
        ("standard.uncertainty_mm", "-0.1", "0.1"),
        ("standard.uncertainty_mm", "nan mm", "0.1"),
        ("temperature.low", "warm", "20"),
    ],
)
def test_a_wrong_answer_is_asked_for_again_with_the_reason(
    keyboard: Type, tmp_path: Path, capsys: pytest.CaptureFixture[str], key: str, wrong: str, right: str
) -> None:
    typed = keyboard({"standard.name": "rule", "temperature.high": "25", key: [wrong, right]})
    laboratory_of(tmp_path, False)
    assert typed.read() == ""
    (reason,) = [line for line in capsys.readouterr().err.splitlines() if "got" in line]
    assert wrong in reason


def test_back_returns_to_the_question_before(keyboard: Type, tmp_path: Path) -> None:
    keyboard({"laboratory.name": "Labb", "laboratory.address": ["back", "Lab", "A street"]})
    lab = laboratory_of(tmp_path, False)
    assert lab.laboratory is not None
    assert (lab.laboratory.name, lab.laboratory.address) == ("Lab", "A street")


def test_the_items_of_a_digital_certificate_are_asked_for(keyboard: Type, tmp_path: Path) -> None:
    named = dict.fromkeys(("laboratory.name", "customer.name", "authorised_by"), "x")
    keyboard(named | {"country": "de"})
    lab = laboratory_of(tmp_path, False)
    assert lab.country == "DE"
    required_parties(lab, record())


def test_no_answers_leave_every_item_open(keyboard: Type, tmp_path: Path) -> None:
    keyboard({})
    assert laboratory_of(tmp_path, False) == Laboratory(format=1)
    assert (tmp_path / "lab.yaml").exists()


def test_the_end_of_the_input_writes_nothing(keyboard: Type, tmp_path: Path) -> None:
    keyboard({}).seek(0, io.SEEK_END)
    with pytest.raises(AnswerNeededError, match=r"nothing was written\. --no-input reports"):
        laboratory_of(tmp_path, False)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("why", ["no terminal", "no input", "ci"])
def test_without_a_person_nothing_is_asked_or_written(
    why: str, keyboard: Type, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    typed = keyboard(ANSWERS)
    if why == "ci":
        monkeypatch.setenv("CI", "1")
    if why == "no terminal":
        monkeypatch.setattr(typed, "isatty", lambda: False)
    assert laboratory_of(tmp_path, why == "no input") == Laboratory(format=1)
    assert typed.tell() == 0
    assert list(tmp_path.iterdir()) == []
