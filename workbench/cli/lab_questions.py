"""Questions about the laboratory, asked once in a terminal; the answers are written to `lab.yaml`."""

from __future__ import annotations

import io
import os
import re
import sys
from collections.abc import Callable
from datetime import date
from math import isfinite
from pathlib import Path

from ruamel.yaml import YAML

from workbench.cli.console import print_message
from workbench.model.laboratory import LABORATORY_FILE, Laboratory, load_laboratory
from workbench.model.text_length import length_error
from workbench.session.files import write_output

Ask = Callable[[str], str]
QUESTIONS = (
    ("laboratory.name", "Name of the laboratory"),
    ("laboratory.address", "Its address"),
    ("country", "Its country, two letters such as DE; --dcc needs it"),
    ("customer.name", "Name of the customer"),
    ("customer.address", "Address of the customer"),
    ("authorised_by", "Person who authorises certificates"),
    ("standard.name", "Reference standard of the standoffs (for example a steel rule)"),
    ("standard.serial", "Its serial number"),
    ("standard.certificate", "Its calibration certificate"),
    ("standard.calibrated", "Day of its calibration, as 2026-11-30"),
    ("standard.uncertainty_mm", "Its expanded uncertainty (k = 2), mm"),
    ("temperature.low", "Lowest temperature of the room, deg C"),
    ("temperature.high", "Highest temperature of the room, deg C"),
    ("target_material", "Material of the target"),
)
HEADING = """\
# What certificates state about the laboratory. docs/certificate.md lists further keys, such as several
# standards, warm-up and the interval of recalibration. What is missing here is reported as not stated.
"""


def laboratory_of(sessions: Path, no_input: bool, ask: Ask) -> Laboratory:
    """The laboratory file of a folder of sessions; without one its items are asked for, once.

    Nothing is written and nothing is stated where there is no terminal, on CI, or with `no_input`.

    Args:
        sessions: folder of sessions.
        no_input: whether to ask nothing.
        ask: shows a question and returns the typed answer.

    Raises:
        BadInputError: the file is wrong, or cannot be written.
    """
    known = load_laboratory(sessions)
    if known is not None:
        return known
    if no_input or os.environ.get("CI") or not (sys.stdin.isatty() and sys.stderr.isatty()):
        return Laboratory(format=1)
    answers = {key: _answer(key, question, ask) for key, question in QUESTIONS}
    write_output(sessions / LABORATORY_FILE, (HEADING + _yaml(answers)).encode())
    return load_laboratory(sessions) or Laboratory(format=1)


def _answer(key: str, question: str, ask: Ask) -> str:
    """Answer in the form of its item, or empty; asked for again, with the reason, until it has that form."""
    parse = FORMS.get(key, _text)
    while True:
        typed = ask(f"{question} (Enter: not stated)").strip()
        if not typed:
            return ""
        try:
            parse(typed)
        except ValueError as wrong:
            print_message(str(wrong))
        else:
            return typed.upper() if key == "country" else typed


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


FORMS: dict[str, Callable[[str], object]] = {
    "country": _country,
    "standard.calibrated": _day,
    "standard.uncertainty_mm": _positive,
    "temperature.low": _finite,
    "temperature.high": _finite,
}
"""Parsers of the answers that are no free text; they raise ValueError with the reason."""


def _yaml(answers: dict[str, str]) -> str:
    content: dict[str, object] = {"format": 1}
    for party in ("laboratory", "customer"):
        if answers[f"{party}.name"]:
            named = {key: answers[f"{party}.{key}"] for key in ("name", "address")}
            content[party] = {key: value for key, value in named.items() if value}
    content |= {key: answers[key] for key in ("country", "authorised_by", "target_material") if answers[key]}
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
