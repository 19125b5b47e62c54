"""Limits on the results of a trial, and trials without readings."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.running import Scripted, running
from tests.support.trial_readings import reading_taken
from workbench.model.errors import LimitFailedError
from workbench.model.event import LimitChecked
from workbench.model.target import Placement
from workbench.trials.accuracy.limits import AccuracyLimits
from workbench.trials.limits import Result, check_results, decision_on, require_readings, skipped_results


def limits(**stated: object) -> AccuracyLimits:
    return AccuracyLimits.model_validate(stated)


def error(value: float | None, expanded: float | None = 0.25, quantity: str = "mean_error_mm") -> Result:
    return Result.of_error(quantity, "500 mm", value, expanded)


@pytest.mark.parametrize(
    ("values", "decision"),
    [((0.7,), "pass"), ((0.7, 0.9), "neither"), ((0.7, 0.9, -1.3), "fail"), ((None,), "fail")],
)
def test_one_failure_fails_and_one_doubt_leaves_neither(
    values: tuple[float | None, ...], decision: str
) -> None:
    stated = limits(mean_error_mm={"in": [-1, 1]})
    assert decision_on([error(value) for value in values], stated) == decision


def test_without_a_limit_on_the_quantity_there_is_no_decision() -> None:
    assert decision_on([error(9.0)], limits()) is None
    assert decision_on([error(9.0)], limits(laser_error_mm={"in": [-1, 1]})) is None


def test_every_result_is_journalled_and_a_failure_ends_with_exit_code_3(tmp_path: Path) -> None:
    stated = limits(mean_error_mm={"in": [-1, 1]})
    with running(tmp_path) as session:
        assert check_results(session.context, "p.1", [error(0.1)], limits()) == ""
        check_results(session.context, "p.1", [error(0.1), error(0.9)], stated)
        with pytest.raises(LimitFailedError, match="mean_error_mm") as caught:
            check_results(session.context, "p.1", [error(0.1), error(2.0)], stated)
        found = [(one.value, one.verdict) for one in session.events if isinstance(one, LimitChecked)]
    assert caught.value.exit_code == 3
    assert found == [(0.1, "pass"), (0.9, "marginal"), (0.1, "pass"), (2.0, "fail")]


def test_the_operator_decides_where_a_limit_asks(tmp_path: Path) -> None:
    operator = Scripted()
    stated = limits(mean_error_mm={"in": [-1, 1], "on_fail": "ask"})
    with running(tmp_path, operator=operator) as session:
        assert "mean_error_mm" in check_results(session.context, "p.1", [error(2.0), error(3.0)], stated)
    assert operator.keys == ["p.1/mean_error_mm"]


def test_a_quantity_that_was_not_measured_fails_its_limit(tmp_path: Path) -> None:
    stated = limits(laser_error_mm={"in": [-1, 1]})
    with running(tmp_path) as session, pytest.raises(LimitFailedError, match="laser_error_mm"):
        check_results(session.context, "p.1", [error(0.1)], stated)


def test_a_skipped_placement_forbids_pass_but_not_fail(tmp_path: Path) -> None:
    stated = limits(mean_error_mm={"in": [-1, 1]})
    skipped = skipped_results([Placement(key="p.1/400mm", standoff_mm=400.0)], stated)
    assert [(one.quantity, one.value) for one in skipped] == [("mean_error_mm", None)]
    assert decision_on([error(0.1), *skipped], stated) == "neither"
    assert decision_on([error(2.0), *skipped], stated) == "fail"
    with running(tmp_path) as session:
        check_results(session.context, "p.1", [error(0.1), *skipped], stated)
        found = [one.verdict for one in session.events if isinstance(one, LimitChecked)]
        with pytest.raises(LimitFailedError):
            check_results(session.context, "p.1", skipped, stated)
    assert found == ["pass", "marginal"]


def test_a_retry_of_a_result_is_refused() -> None:
    with pytest.raises(ValueError, match="retry"):
        limits(mean_error_mm={"in": [-1, 1], "on_fail": "retry"})


def test_a_trial_without_readings_fails() -> None:
    require_readings("p.1", [[reading_taken(500.2), reading_taken(None)]])
    for readings in ([], [[reading_taken(500.2)], [reading_taken(None), reading_taken(None)]]):
        with pytest.raises(LimitFailedError, match=r"p\.1") as caught:
            require_readings("p.1", readings)
        assert caught.value.exit_code == 3
