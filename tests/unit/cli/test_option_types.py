"""Numbers on the command line."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.command_line import Run, refused
from tests.support.reference_session import SERIAL, copied
from workbench.model.text_length import LONGEST_NAME, LONGEST_TEXT

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("range --rig r --calibration c --readings 0", "a whole number of at least 1, such as 10, got 0"),
        ("range --rig r --calibration c --readings x", "a whole number of at least 1, such as 10, got x"),
        (
            "range --rig r --calibration c --standoff nan",
            "millimetres from 1 to 1e+06, such as 500, got nan",
        ),
        (
            "range --rig r --calibration c --standoff 1e300",
            "millimetres from 1 to 1e+06, such as 500, got 1e300",
        ),
        (
            "fit c.csv -o c.yaml --without-standoff far",
            "millimetres from 0 to 1e+06, such as 500, got far",
        ),
        ("design --rig r --count few", "a whole number of at least 1, such as 10, got few"),
    ],
)
def test_numbers_that_are_none(workbench: Run, line: str, says: str) -> None:
    outcome = workbench(*line.split())
    refused(outcome, 2, f"expected {says}")
    assert "Input should" not in outcome.err


@pytest.mark.parametrize(
    ("options", "longest"), [("--note x --operator", LONGEST_NAME), ("--note", LONGEST_TEXT)]
)
def test_overlong_texts_are_refused(workbench: Run, tmp_path: Path, options: str, longest: int) -> None:
    line = ["history", "--sessions", tmp_path, "--rig", SERIAL, *options.split()]
    copied(tmp_path)
    refused(workbench(*line, "x" * (longest + 1)), 2, str(longest))
    assert workbench(*line, "x" * longest).code == 0
