"""Numbers that are not finite count as missing."""

from __future__ import annotations

import math
from typing import Any

import pytest

from workbench.model.finite import finite_or_none


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_number_that_json_cannot_hold_is_missing(value: float) -> None:
    assert finite_or_none(value) is None


@pytest.mark.parametrize("value", [0.0, -1.5, 1e308, 10**400, True, "nan", None, [math.nan]])
def test_anything_else_stays(value: Any) -> None:
    assert finite_or_none(value) is value
