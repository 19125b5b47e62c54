"""Field types of procedure files: their limits."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from workbench.model.fields import Count, Standoff, Standoffs, require_different

STANDOFF, STANDOFFS, COUNT = TypeAdapter(Standoff), TypeAdapter(Standoffs), TypeAdapter(Count)


@pytest.mark.parametrize(
    ("adapter", "good"),
    [(STANDOFF, 1e-3), (STANDOFF, 1e6), (STANDOFFS, [500.0]), (COUNT, 1), (COUNT, 1_000_000)],
)
def test_limits_themselves_are_good(adapter: TypeAdapter[Any], good: Any) -> None:
    found = adapter.validate_python(good)
    assert found == (tuple(good) if isinstance(good, list) else good)


@pytest.mark.parametrize(
    ("adapter", "wrong"),
    [
        (STANDOFF, 0.0),
        (STANDOFF, -1.0),
        (STANDOFF, 1.001e6),
        (STANDOFFS, []),
        (STANDOFFS, [500.0, 0.0]),
        (COUNT, 0),
        (COUNT, 1_000_001),
        (COUNT, 2.5),
    ],
)
def test_beyond_them_is_wrong(adapter: TypeAdapter[Any], wrong: Any) -> None:
    with pytest.raises(ValidationError):
        adapter.validate_python(wrong)


def test_standoffs_differ_in_their_first_twelve_digits() -> None:
    require_different((500.0, 500.0000001), "repeats")
    for same in ((500.0, 700.0, 500.0), (500.0, 500.0 + 1e-10)):
        with pytest.raises(ValueError, match=r"got 500 mm .*`repeats`"):
            require_different(same, "repeats")
