"""Questions about the laboratory, asked once in a terminal; the answers are written to `lab.yaml`."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Mapping
from datetime import date
from functools import partial
from math import isfinite
from pathlib import Path

from ruamel.yaml import YAML

from workbench.cli.dialogue import Question, ask_all, is_interactive
from workbench.model.laboratory import LABORATORY_FILE, Laboratory, load_laboratory
from workbench.model.text_length import length_error
from workbench.session.files import write_output

HEADING = """\
# What certificates state about the laboratory. docs/certificate.md lists further keys, such as several
# standards, warm-up and the interval of recalibration. What is missing here is reported as not stated.
"""


def laboratory_of(sessions: Path, no_input: bool) -> Laboratory:
    """The laboratory file of a folder of sessions; without one its items are asked for, once.

    Nothing is written and nothing is stated where there is no terminal, on CI, or with `no_input`.

    Args:
        sessions: folder of sessions.
        no_input: whether to ask nothing.

    Raises:
        BadInputError: the file is wrong, or cannot be written.
        AnswerNeededError: the terminal was closed, or end-of-file was typed.
    """
    known = load_laboratory(sessions)
    if known is not None:
        return known
    if no_input or not is_interactive():
        return Laboratory(format=1)
    answers = ask_all(QUESTIONS, without="--no-input reports what is not known as not stated")
    write_output(sessions / LABORATORY_FILE, (HEADING + _yaml(answers)).encode())
    return load_laboratory(sessions) or Laboratory(format=1)


def _text(typed: str) -> str:
    if wrong := length_error(typed):
        raise ValueError(wrong)
    return typed


def _country(typed: str) -> str:
    if not re.fullmatch("[A-Za-z]{2}", typed):
        raise ValueError(f"expected two letters (ISO 3166-1), such as DE or US, got {typed}")
    return typed


def _day(typed: str) -> date:
    try:
        return date.fromisoformat(typed)
    except ValueError:
        raise ValueError(f"expected a day as year-month-day, such as 2026-11-30, got {typed}") from None


def _finite(typed: str) -> float:
    value = number(typed)
    if value is None:
        raise ValueError(f"expected a number without unit, such as 21.5, got {typed}")
    return value


def _positive(typed: str) -> float:
    value = _finite(typed)
    if value <= 0:
        raise ValueError(f"expected a number above 0, got {typed}")
    return value


def _question(key: str, text: str, hint: str = "", check: Callable[[str], object] = _text) -> Question:
    """A question that may be left open: Enter alone is the answer "not stated"."""
    open_or_checked = partial(_open_or, check)
    return Question(key, text, f"{hint}; Enter: not stated" if hint else "Enter: not stated", open_or_checked)


def _open_or(check: Callable[[str], object], typed: str, _: Mapping[str, str]) -> object:
    return check(typed) if typed else None


QUESTIONS = (
    _question("laboratory.name", "Name of the laboratory"),
    _question("laboratory.address", "Its address"),
    _question("country", "Its country", "two letters such as DE; --dcc needs it", _country),
    _question("customer.name", "Name of the customer"),
    _question("customer.address", "Address of the customer"),
    _question("authorised_by", "Person who authorises certificates"),
    _question("standard.name", "Reference standard of the standoffs", "for example a steel rule"),
    _question("standard.serial", "Its serial number"),
    _question("standard.certificate", "Its calibration certificate"),
    _question("standard.calibrated", "Day of its calibration", "such as 2026-11-30", _day),
    _question("standard.uncertainty_mm", "Its expanded uncertainty (k = 2), mm", "such as 0.1", _positive),
    _question("temperature.low", "Lowest temperature of the room, deg C", check=_finite),
    _question("temperature.high", "Highest temperature of the room, deg C", check=_finite),
    _question("target_material", "Material of the target"),
)


def _yaml(answers: dict[str, str]) -> str:
    content: dict[str, object] = {"format": 1}
    for party in ("laboratory", "customer"):
        if answers[f"{party}.name"]:
            named = {key: answers[f"{party}.{key}"] for key in ("name", "address")}
            content[party] = {key: value for key, value in named.items() if value}
    content |= {key: answers[key] for key in ("authorised_by", "target_material") if answers[key]}
    if answers["country"]:
        content["country"] = answers["country"].upper()
    if answers["standard.name"]:
        content["standards"] = [_standard(answers)]
    span = [number(answers[f"temperature.{end}"]) for end in ("low", "high")]
    if None not in span:
        content["ambient"] = {"temperature_c": sorted(value for value in span if value is not None)}
    stream = io.StringIO()
    YAML().dump(content, stream)
    return stream.getvalue()


def _standard(answers: dict[str, str]) -> dict[str, object]:
    named = {key: answers[f"standard.{key}"] for key in ("name", "serial", "certificate", "calibrated")}
    standard: dict[str, object] = {key: value for key, value in named.items() if value}
    if (uncertainty_mm := number(answers["standard.uncertainty_mm"])) is not None:
        standard |= {"expanded_uncertainty": uncertainty_mm, "unit": "mm"}
    return standard


def number(typed: str) -> float | None:
    """Typed finite number, with a point or a comma; None for anything else."""
    try:
        value = float(typed.replace(",", "."))
    except ValueError:
        return None
    return value if isfinite(value) else None
