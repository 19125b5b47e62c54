"""Decision with guard bands."""

from __future__ import annotations

from math import inf, nan

import numpy as np
import pytest

from workbench.trials.statistics.decision import decide

U = 0.25


@pytest.mark.parametrize(
    ("error_mm", "decision"),
    [
        (0.0, "pass"),
        (0.75, "pass"),
        (-0.75, "pass"),
        (0.8, "neither"),
        (-1.2, "neither"),
        (1.25, "fail"),
        (-9.0, "fail"),
    ],
)
def test_guard_bands_leave_neither_between_pass_and_fail(error_mm: float, decision: str) -> None:
    assert decide((-1.0, 1.0), error_mm - U, error_mm + U) == decision


def test_an_uncertainty_above_the_limit_never_passes() -> None:
    found = {decide((-1.0, 1.0), error - 1.5, error + 1.5) for error in np.linspace(-2.4, 2.4, 9)}
    assert found == {"neither"}


@pytest.mark.parametrize(
    ("value", "decision"), [(0.99, "pass"), (1.0, "pass"), (1.01, "fail"), (-5.0, "pass")]
)
def test_a_value_without_uncertainty_passes_or_fails(value: float, decision: str) -> None:
    assert decide((None, 1.0), value, value) == decision


def test_an_infinite_interval_is_decided_by_its_finite_end() -> None:
    assert decide((None, 1.0), 1.5, inf) == "fail"
    assert decide((None, 1.0), 0.5, inf) == "neither"
    assert decide((0.0, None), 0.5, inf) == "pass"


@pytest.mark.parametrize(("low", "high"), [(1.0, 0.0), (nan, 1.0), (0.0, nan)])
def test_an_interval_that_is_none_is_refused(low: float, high: float) -> None:
    with pytest.raises(ValueError, match="low"):
        decide((0.0, 1.0), low, high)
