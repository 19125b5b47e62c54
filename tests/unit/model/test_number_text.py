"""Digits of numbers for people."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench.model.number_text import counted, duration, probability, significant, two_digits, with_sd


@pytest.mark.parametrize(
    ("value", "sd", "text"),
    [
        (541.234, 22.0, "541"),
        (358.21, 2.14, "358.2"),
        (0.00112, 0.0008, "0.00112"),
        (-0.001, 0.5, "0.00"),
        (-60.0, 0.0, "-60"),
        (12345.6, 300.0, "12346"),
    ],
)
def test_a_value_has_the_digits_of_its_sd(value: float, sd: float, text: str) -> None:
    assert significant(value, sd) == text


@given(value=st.floats(-1e6, 1e6), sd=st.floats(1e-6, 1e3))
def test_rounding_changes_a_value_by_less_than_a_tenth_of_its_sd(value: float, sd: float) -> None:
    assert abs(float(significant(value, sd)) - value) <= max(0.0501 * sd, 0.5000001 * (sd >= 10))


@pytest.mark.parametrize(
    ("sd", "text"), [(0.0, "0"), (0.3, "0.3"), (0.0996, "0.1"), (2.14, "2.1"), (22.4, "22")]
)
def test_an_sd_has_two_significant_digits(sd: float, text: str) -> None:
    assert two_digits(sd) == text


def test_value_and_sd_together() -> None:
    assert with_sd(500.312, 0.42) == "500.31 +- 0.42"


@pytest.mark.parametrize(
    ("seconds", "text"), [(0, "0 s"), (119, "119 s"), (120, "2 min"), (7199, "120 min"), (7200, "2.0 h")]
)
def test_durations_get_coarser(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def test_one_thing_is_singular() -> None:
    assert [counted(number, "spot") for number in (0, 1, 2)] == ["0 spots", "1 spot", "2 spots"]


def test_a_p_value_close_to_1_has_no_digits() -> None:
    assert [probability(p) for p in (1.0, 0.9951, 0.99, 0.0312)] == [
        "p > 0.99",
        "p > 0.99",
        "p = 0.99",
        "p = 0.031",
    ]
