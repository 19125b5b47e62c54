"""Step `check_limits`."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.running import Scripted, running, two_laser_rig
from tests.support.steps import parse_step, wrong_keys
from workbench.model.calibration import load_calibration
from workbench.model.errors import BadInputError, LimitFailedError
from workbench.model.event import LimitChecked

ACCEPTED = load_calibration(Path(__file__).parents[3] / "data/session-0.1.0/calibration.yaml")
RMS_PX = ACCEPTED.laser_ranger.fit.rms_px


def step_with(low: float, high: float, on_fail: str = "stop") -> str:
    return f"step: check_limits, limits: {{rms_px: {{in: [{low}, {high}], on_fail: {on_fail}}}}}"


def test_limits_are_quantities_of_a_fit_and_none_is_retried() -> None:
    assert wrong_keys(step_with(0, 1, "retry")) == ["steps[0].limits"]
    assert wrong_keys("step: check_limits, limits: {rms: {in: [0, 1]}}") == ["steps[0].limits.rms"]
    assert wrong_keys("step: check_limits") == ["steps[0].limits"]


def test_only_limits_that_ask_have_prompts() -> None:
    rig = two_laser_rig()
    assert list(parse_step(step_with(0, 1)).prompts("p.4", rig)) == []
    assert [prompt.key for prompt in parse_step(step_with(0, 1, "ask")).prompts("p.4", rig)] == ["p.4/rms_px"]
    assert (parse_step(step_with(0, 1)).needs, parse_step(step_with(0, 1)).default_duration_s) == ("fit", 1.0)


@pytest.mark.parametrize(("factor", "verdict"), [(1.1, "pass"), (0.9, "fail")])
def test_the_fits_own_numbers_are_held_against_them(tmp_path: Path, factor: float, verdict: str) -> None:
    operator = Scripted()
    with running(tmp_path, operator=operator) as session:
        session.context.accepted = ACCEPTED
        parse_step(step_with(0, factor * RMS_PX, "ask")).run(session.context, "p.4")
        (checked,) = [event for event in session.events if isinstance(event, LimitChecked)]
    assert (checked.quantity, checked.value, checked.verdict) == ("rms_px", RMS_PX, verdict)
    assert operator.keys == ([] if verdict == "pass" else ["p.4/rms_px"])


def test_a_limit_that_stops_ends_with_exit_code_3(tmp_path: Path) -> None:
    with running(tmp_path) as session:
        session.context.accepted = ACCEPTED
        with pytest.raises(LimitFailedError, match="rms_px") as caught:
            parse_step(step_with(0, 0.5 * RMS_PX)).run(session.context, "p.4")
    assert caught.value.exit_code == 3


def test_without_a_fit_there_is_nothing_to_check(tmp_path: Path) -> None:
    with running(tmp_path) as session, pytest.raises(BadInputError, match=r"p\.4"):
        parse_step(step_with(0, 1)).run(session.context, "p.4")
