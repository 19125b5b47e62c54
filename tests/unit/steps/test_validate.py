"""Step `validate`."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.running import Scripted, running, two_laser_rig
from tests.support.steps import parse_step, wrong_keys
from workbench.model.errors import BadInputError, LimitFailedError
from workbench.model.event import LimitChecked
from workbench.model.fit_event import CrossValidatedPlacement

BOTH = "worst_relative_error: {in: [0, 0.01]}, worst_z: {in: [0, 3], on_fail: ask}"


def left_out(standoff_mm: float, error_mm: float, sd_mm: float) -> CrossValidatedPlacement:
    return CrossValidatedPlacement(
        placement=f"{standoff_mm:g}", standoff_mm=standoff_mm, error_mm=error_mm, sd_mm=sd_mm, lasers=()
    )


def test_limits_are_its_own_quantities_and_none_is_retried() -> None:
    assert wrong_keys("step: validate, limits: {worst_z: {in: [0, 3], on_fail: retry}}") == [
        "steps[0].limits"
    ]
    assert wrong_keys("step: validate, limits: {rms_px: {in: [0, 1]}}") == ["steps[0].limits.rms_px"]


def test_only_limits_that_ask_have_prompts() -> None:
    step = parse_step(f"step: validate, limits: {{{BOTH}}}")
    assert [prompt.key for prompt in step.prompts("p.3", two_laser_rig())] == ["p.3/worst_z"]
    assert (step.needs, step.gives, step.default_duration_s) == ("fit", None, 1.0)


def test_the_worst_placement_of_either_sign_is_held_against_the_limits(tmp_path: Path) -> None:
    operator = Scripted()
    with running(tmp_path, operator=operator) as session:
        # The worst relative error is the second's, the worst z the third's.
        session.context.cross_validation = (
            left_out(300.0, 0.1, 1.0),
            left_out(500.0, -4.0, 4.0),
            left_out(1000.0, -3.5, 1.0),
        )
        parse_step(f"step: validate, limits: {{{BOTH}}}").run(session.context, "p.3")
        checked = [event for event in session.events if isinstance(event, LimitChecked)]
    assert [(event.quantity, event.verdict) for event in checked] == [
        ("worst_relative_error", "pass"),
        ("worst_z", "fail"),
    ]
    assert [event.value for event in checked] == pytest.approx([4.0 / 500, 3.5])
    assert operator.keys == ["p.3/worst_z"]


def test_a_limit_that_stops_ends_with_exit_code_3(tmp_path: Path) -> None:
    with running(tmp_path) as session:
        session.context.cross_validation = (left_out(300.0, 6.0, 4.0),)
        with pytest.raises(LimitFailedError, match="worst_relative_error") as caught:
            parse_step(f"step: validate, limits: {{{BOTH}}}").run(session.context, "p.3")
    assert caught.value.exit_code == 3


def test_without_a_fit_there_is_nothing_to_validate(tmp_path: Path) -> None:
    with running(tmp_path) as session, pytest.raises(BadInputError, match=r"p\.3"):
        parse_step("step: validate").run(session.context, "p.3")
