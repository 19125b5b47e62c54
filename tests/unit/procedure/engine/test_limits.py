"""Limits on captures and fits."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import ValidationError

from tests.support.running import Running, Scripted, running, two_laser_rig
from workbench.model.errors import LimitFailedError
from workbench.model.event import LimitChecked, SetAside
from workbench.model.prompt import Action, Answer
from workbench.procedure.capture.quality import CaptureLimits
from workbench.procedure.engine.lasers import capture_lasers
from workbench.procedure.engine.limits import (
    RETRIES,
    capture_limit_prompts,
    check_captures,
    check_fit,
    result_limit_prompts,
    why_not_measured,
)
from workbench.procedure.engine.placements import RetakeError
from workbench.procedure.engine.step import flat_placement
from workbench.steps.check_limits import FitLimits


@pytest.mark.parametrize(
    ("spots", "parts"),
    [
        ([0], ("L4", "1 capture")),
        ([0] * 10, ("L4", "10 captures")),
        ([0, 2, 3], ("L4", "ambiguous", "3 spots", "3 captures")),
        ([1, 0], ("L4", "scatter_px")),
    ],
)
def test_the_reason_for_a_missing_quantity_has_laser_and_counts(
    spots: list[int], parts: tuple[str, ...]
) -> None:
    reason = why_not_measured("scatter_px", "L4", spots)
    assert all(part in reason for part in parts)


PLACEMENT = flat_placement("p.1", 500.0)


def limits(**stated: dict[str, object]) -> CaptureLimits:
    return CaptureLimits.model_validate(stated)


def captured(session: Running, repeats: int = 2) -> None:
    context = session.context
    context.confirm_safety()
    context.bench.target.place(PLACEMENT)
    capture_lasers(context, PLACEMENT, repeats)


def test_limits_that_ask_have_a_prompt_for_each_laser_and_placement() -> None:
    asking = limits(snr={"in": [5, None], "on_fail": "ask"}, missing={"in": [0, 0.1]})
    placements = [PLACEMENT, flat_placement("p.1", 800.0)]
    keys = [prompt.key for prompt in capture_limit_prompts(placements, two_laser_rig(), asking)]
    assert keys == [f"p.1/{mm}mm/{one}/snr" for mm in (500, 800) for one in ("L1", "L2")]
    fit = FitLimits.model_validate({"rms_px": {"in": [0, 1], "on_fail": "ask"}, "rejected": {"in": [0, 3]}})
    (prompt,) = result_limit_prompts("p.3", fit)
    assert (prompt.key, prompt.overrules) == ("p.3/rms_px", True)


def test_a_limit_that_is_kept_is_journalled_with_its_value(tmp_path: Path) -> None:
    with running(tmp_path) as session:
        captured(session)
        check_captures(session.context, "p.1", PLACEMENT, limits(snr={"in": [5, None]}))
        checked = [event for event in session.events if isinstance(event, LimitChecked)]
    assert [(event.of, event.quantity, event.verdict) for event in checked] == [
        ("p.1/500mm/L1", "snr", "pass"),
        ("p.1/500mm/L2", "snr", "pass"),
    ]
    assert all(event.value is not None and event.value > 5 for event in checked)


def test_a_limit_that_fails_stops_with_exit_code_3(tmp_path: Path) -> None:
    with running(tmp_path) as session:
        captured(session)
        with pytest.raises(LimitFailedError, match=r"p\.1/500mm/L1: snr: .*1e\+06") as caught:
            check_captures(session.context, "p.1", PLACEMENT, limits(snr={"in": [1e6, None]}))
        assert isinstance(event := session.events[-1], LimitChecked)
        assert event.verdict == "fail"
    assert caught.value.exit_code == 3


def test_a_retry_has_the_placement_captured_again_twice_then_stops(tmp_path: Path) -> None:
    failing = limits(snr={"in": [1e6, None], "on_fail": "retry"})
    with running(tmp_path) as session:
        captured(session)
        for _ in range(RETRIES):
            with pytest.raises(RetakeError) as again:
                check_captures(session.context, "p.1", PLACEMENT, failing)
            assert again.value.by_limit
            session.context.emit(SetAside(key=PLACEMENT.key, from_n=0, reason="snr", retry=True))
        with pytest.raises(LimitFailedError):
            check_captures(session.context, "p.1", PLACEMENT, failing)


@pytest.mark.parametrize("action", ["done", "redo"])
def test_the_operator_keeps_captures_or_has_them_taken_again(tmp_path: Path, action: Action) -> None:
    answer = Answer(action=action, reason=None if action == "done" else "a reflection")
    operator = Scripted({"p.1/500mm/L1/snr": [answer]})
    asking = limits(snr={"in": [1e6, None], "on_fail": "ask"})
    with running(tmp_path, operator=operator) as session:
        captured(session)
        if action == "redo":
            with pytest.raises(RetakeError, match="a reflection") as again:
                check_captures(session.context, "p.1", PLACEMENT, asking)
            assert not again.value.by_limit
        else:
            check_captures(session.context, "p.1", PLACEMENT, asking)
            assert operator.keys[-2:] == ["p.1/500mm/L1/snr", "p.1/500mm/L2/snr"]


def test_a_fit_is_held_against_the_limits_of_its_names(tmp_path: Path) -> None:
    stated = FitLimits.model_validate(
        {"rms_px": {"in": [None, 0.5], "on_fail": "ask"}, "rejected": {"in": [0, 3]}}
    )
    operator = Scripted()
    with running(tmp_path, operator=operator) as session:
        check_fit(session.context, "p.3", {"rms_px": 0.4, "rejected": 0}, stated)
        assert operator.keys == []
        assert "0.7" in check_fit(session.context, "p.3", {"rms_px": 0.7, "rejected": 0}, stated)
        assert operator.keys == ["p.3/rms_px"]
        with pytest.raises(LimitFailedError, match=r"rejected.*4"):
            check_fit(session.context, "p.3", {"rms_px": 0.4, "rejected": 4}, stated)
        verdicts = [event.verdict for event in session.events if isinstance(event, LimitChecked)]
    assert verdicts == ["pass", "pass", "fail", "pass", "pass", "fail"]


def test_a_limit_on_a_fit_cannot_have_it_retried() -> None:
    with pytest.raises(ValidationError, match="rms_px"):
        FitLimits.model_validate({"rms_px": {"in": [0, 1], "on_fail": "retry"}})
