"""Numbers on the command line."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.command_line import Run, refused

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
