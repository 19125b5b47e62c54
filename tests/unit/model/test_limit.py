"""Limits: their bounds, and those that are refused."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from workbench.model.limit import Limit

finite = st.floats(-1e6, 1e6)


@given(finite, finite, finite, finite, finite)
def test_a_limit_is_its_bounds(a: float, b: float, c: float, d: float, value: float) -> None:
    low, inner_low, inner_high, high = sorted((a, b, c, d))
    limit = Limit.model_validate({"in": [low, high], "marginal": [inner_low, inner_high]})
    if not low <= value <= high:
        assert limit.judge(value) == "fail"
    else:
        assert limit.judge(value) == ("pass" if inner_low <= value <= inner_high else "marginal")
    assert Limit.model_validate({"in": [low, None]}).judge(value) == ("pass" if value >= low else "fail")
    assert limit.judge(None) == "fail"


@pytest.mark.parametrize(
    "wrong",
    [
        {"in": [2, 1]},
        {"in": [None, None]},
        {"in": [0, 1], "marginal": [0, 2]},
        {"in": [1, 2], "marginal": [0, 2]},
        {"in": [0, 1], "on_fail": "shrug"},
    ],
)
def test_a_limit_that_makes_no_sense(wrong: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        Limit.model_validate(wrong)
