"""Compiled loops: what they may reorder, and that numbers that are none stay so."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numba.core.caching import CacheImpl

from workbench.model.arrays import FloatArray
from workbench.spots.kernels.compiled import _warn_without_cache, compiled


@compiled
def total(values: FloatArray) -> float:
    result = 0.0
    for i in range(values.size):
        result += values[i]
    return result


@compiled
def quotient(a: float, b: float) -> float:
    return a / b


@compiled
def is_number(value: float) -> bool:
    return value == value and abs(value) < math.inf


def test_a_sum_is_that_of_numpy_to_rounding() -> None:
    values = np.random.default_rng(1).normal(0.0, 1.0, 10_001)
    assert total(values) == pytest.approx(math.fsum(values), abs=1e-10)


def test_a_number_that_is_none_spoils_the_sum_and_is_seen() -> None:
    values = np.ones(100)
    values[40] = np.nan
    assert math.isnan(total(values))
    assert [is_number(x) for x in (1.0, math.nan, math.inf, -math.inf)] == [True, False, False, False]


def test_division_by_zero_is_as_in_numpy() -> None:
    assert quotient(1.0, 0.0) == math.inf
    assert math.isnan(quotient(0.0, 0.0))


def test_without_a_place_for_machine_code_it_compiles_and_warns_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """As where the program's folder and the user's cache cannot be written."""
    monkeypatch.setattr(CacheImpl, "_locator_classes", [])
    _warn_without_cache.cache_clear()
    with pytest.warns(UserWarning, match="NUMBA_CACHE_DIR") as warned:
        doubled = [compiled(twice), compiled(twice)]
    assert len(warned) == 1
    assert [one(2.0) for one in doubled] == [4.0, 4.0]


def twice(value: float) -> float:
    return 2.0 * value
