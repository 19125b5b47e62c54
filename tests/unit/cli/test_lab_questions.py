"""Questions about the laboratory: asked once in a terminal, never without one."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests.support.reference_session import record
from workbench.cli.lab_questions import QUESTIONS, laboratory_of
from workbench.model.laboratory import Laboratory
from workbench.report.certificate.dcc import required_parties

ANSWERS = {
    "Name of the laboratory": "Lab: the <b>best</b>",
    "Reference standard of the standoffs (for example a steel rule)": "steel rule",
    "Day of its calibration, as 2026-11-30": "2026-05-04",
    "Its expanded uncertainty (k = 2), mm": "0,1",
    "Lowest temperature of the room, deg C": "22",
    "Highest temperature of the room, deg C": "20",
}


class Person:
    def __init__(self, answers: dict[str, str]) -> None:
        self.answers = answers
        self.asked: list[str] = []

    def __call__(self, question: str) -> str:
        self.asked.append(question)
        return self.answers.get(question.partition(" (Enter")[0], "")


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CI", raising=False)
    for stream in (sys.stdin, sys.stderr):
        monkeypatch.setattr(stream, "isatty", lambda: True, raising=False)


def test_answers_are_written_and_not_asked_for_again(terminal: None, tmp_path: Path) -> None:
    person = Person(ANSWERS)
    lab = laboratory_of(tmp_path, False, person)
    assert len(person.asked) == len(QUESTIONS)
    assert lab.laboratory is not None
    assert lab.laboratory.name == "Lab: the <b>best</b>"
    assert (lab.customer, lab.authorised_by) == (None, "")
    assert lab.standards[0].expanded_uncertainty == 0.1
    assert lab.ambient.temperature_c == (20.0, 22.0)
    assert laboratory_of(tmp_path, False, person) == lab
    assert len(person.asked) == len(QUESTIONS)


def test_wrong_days_and_numbers_are_asked_for_again(terminal: None, tmp_path: Path) -> None:
    typed = {"Day of its": ["yesterday", "2026-05-04"], "Its expanded": ["a little", "nan mm", "0.1"]}
    asked: list[str] = []

    def ask(question: str) -> str:
        asked.append(question)
        found = next((answers for start, answers in typed.items() if question.startswith(start)), None)
        return "rule" if found is None and question.startswith("Reference") else found.pop(0) if found else ""

    lab = laboratory_of(tmp_path, False, ask)
    assert len(asked) == len(QUESTIONS) + 3
    assert (str(lab.standards[0].calibrated), lab.standards[0].expanded_uncertainty) == ("2026-05-04", 0.1)


@pytest.mark.parametrize(
    ("key", "wrong", "right"),
    [
        ("country", "Germany", "de"),
        ("standard.calibrated", "4 May", "2026-05-04"),
        ("standard.uncertainty_mm", "-0.1", "0.1"),
        ("standard.uncertainty_mm", "0.1 mm", "0.1"),
        ("temperature.low", "warm", "20"),
    ],
)
def test_the_reason_is_printed_before_a_question_is_asked_again(
    terminal: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, key: str, wrong: str, right: str
) -> None:
    printed: list[str] = []
    monkeypatch.setattr("workbench.cli.lab_questions.print_message", printed.append)
    typed = [wrong, right]
    question = dict(QUESTIONS)[key]

    def ask(asked: str) -> str:
        if not asked.startswith(question):
            return "rule" if asked.startswith("Reference") else ""
        assert len(printed) == 2 - len(typed)
        return typed.pop(0)

    laboratory_of(tmp_path, False, ask)
    assert typed == []
    (reason,) = printed
    assert wrong in reason


def test_the_items_of_a_digital_certificate_are_asked_for(terminal: None, tmp_path: Path) -> None:
    names = ("Name of the laboratory", "Name of the customer", "Person who authorises certificates")
    answers = dict.fromkeys(names, "x") | {dict(QUESTIONS)["country"]: "de"}
    lab = laboratory_of(tmp_path, False, Person(answers))
    assert lab.country == "DE"
    required_parties(lab, record())


def test_no_answers_leave_every_item_open(terminal: None, tmp_path: Path) -> None:
    assert laboratory_of(tmp_path, False, Person({})) == Laboratory(format=1)
    assert (tmp_path / "lab.yaml").exists()


@pytest.mark.parametrize("why", ["no terminal", "no input", "ci"])
def test_without_a_person_nothing_is_asked_or_written(
    why: str, terminal: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    if why == "ci":
        monkeypatch.setenv("CI", "1")
    if why == "no terminal":
        monkeypatch.setattr(sys.stdin, "isatty", lambda: False, raising=False)
    person = Person(ANSWERS)
    assert laboratory_of(tmp_path, why == "no input", person) == Laboratory(format=1)
    assert person.asked == []
    assert list(tmp_path.iterdir()) == []
