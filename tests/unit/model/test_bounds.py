"""Bounds of numbers: the ends are accepted, what lies beyond is refused with the reason."""

from __future__ import annotations

from math import inf, nextafter
from typing import Annotated

import pytest
from pydantic import TypeAdapter, ValidationError

from workbench.model.bounds import RECORDED, prior_within, within
from workbench.model.prior import Prior

LOW, HIGH, MOST_SD = -2.0, 5.0, 3.0
NUMBER = TypeAdapter(Annotated[float, within(LOW, HIGH, "metres")])
PRIOR = TypeAdapter(Annotated[Prior, prior_within(LOW, HIGH, MOST_SD, "metres")])


@pytest.mark.parametrize("value", [LOW, 0.0, HIGH])
def test_a_number_within_its_bounds_is_accepted(value: float) -> None:
    assert NUMBER.validate_python(value) == value
    assert PRIOR.validate_python({"value": value, "sd": MOST_SD}) == Prior(value=value, sd=MOST_SD)


@pytest.mark.parametrize("value", [nextafter(LOW, -inf), nextafter(HIGH, inf), 1e300])
def test_a_number_beyond_its_bounds_is_refused_with_the_reason(value: float) -> None:
    with pytest.raises(ValidationError, match="metres"):
        NUMBER.validate_python(value)
    with pytest.raises(ValidationError):
        PRIOR.validate_python({"value": value, "sd": 0.0})


def test_a_recorded_number_has_no_bounds() -> None:
    assert NUMBER.validate_python(1e300, context=RECORDED) == 1e300
    assert PRIOR.validate_python({"value": 9.0, "sd": 9.0}, context=RECORDED).value == 9.0


def test_a_deviation_beyond_its_bound_is_refused() -> None:
    with pytest.raises(ValidationError, match="metres"):
        PRIOR.validate_python({"value": 0.0, "sd": nextafter(MOST_SD, inf)})


def test_a_whole_number_of_any_length_is_shown() -> None:
    with pytest.raises(ValidationError, match="1000"):
        TypeAdapter(Annotated[int, within(0, 9, "digits")]).validate_python(10**400)
