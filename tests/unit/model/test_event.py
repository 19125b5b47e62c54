"""Records of a session: each kind is read back as itself, and its text has its numbers."""

from __future__ import annotations

from typing import get_args

import pytest
from pydantic import ValidationError

from workbench.model import event as ev
from workbench.model.target import CylinderTarget, Placement
from workbench.model.trial_event import TrialProgress

FRAME = ev.FrameRef(path="frames/P1/on.png", sha256="0" * 64, time_ns=5)
CAPTURE = ev.CaptureTaken(
    key="P1/all/0", purpose="trial", laser_id="all", placement_key="P1", standoff_mm=500.0, repeat=0, on=FRAME
)
EXPOSURE = ev.ExposureSet(key="P1", exposure=120.0, unit="us", peak=0.62, verdict="good", trials=3)
ADVICE = ev.StandoffAdvised(
    placements=4,
    relative_range_sd=0.0123,
    limit=0.05,
    next_standoff_mm=1250.0,
    then_relative_range_sd=0.0087,
)
EVENTS: list[ev.Event] = [
    ev.SessionStarted(session="s", rig="r", procedures=("p",)),
    ev.TargetPlaced(placement=Placement(key="P", standoff_mm=500.0, target=CylinderTarget(diameter_mm=9.0))),
    CAPTURE,
    EXPOSURE,
    ADVICE,
    ev.SpotsFound(key="P1/all/0", spots=(), failures=("no_spot",)),
    ev.LimitChecked(step="fit", of="fit", quantity="rms_px", value=None, limit="at most 1", verdict="fail"),
    TrialProgress(trial="t", text="x"),
    ev.SessionFinished(exit_code=3, message="why"),
]


@pytest.mark.parametrize("event", EVENTS, ids=lambda e: e.kind)
def test_a_record_is_read_back_as_the_event_that_it_was(event: ev.Event) -> None:
    record = ev.Record(n=7, time_ns=1_700_000_000_000_000_000, event=event)
    again = ev.Record.model_validate_json(record.model_dump_json())
    assert again == record
    assert type(again.event) is type(event)


def test_each_kind_has_a_name_of_its_own() -> None:
    union = get_args(get_args(ev.Event)[0])
    kinds = [model.model_fields["kind"].default for model in union]
    assert len(set(kinds)) == len(kinds) > 15


@pytest.mark.parametrize(
    "data",
    [
        {"n": 0, "time_ns": 1, "event": {"kind": "unheard_of"}},
        {"n": 0, "time_ns": 1, "event": {"session": "s"}},
        {"n": 0, "event": {"kind": "session_finished", "exit_code": 0, "message": ""}},
        {
            "n": 0,
            "time_ns": 1,
            "event": {"kind": "session_finished", "exit_code": 0, "message": "", "more": 1},
        },
    ],
)
def test_records_that_cannot_be_are_refused(data: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        ev.Record.model_validate(data)


@pytest.mark.parametrize(("peak", "verdict", "percent"), [(0.62, "good", "62"), (1.0, "clipped", "100")])
def test_the_text_of_an_exposure_has_its_unit_and_the_peak_in_percent(
    peak: float, verdict: str, percent: str
) -> None:
    event = ev.ExposureSet.model_validate(EXPOSURE.model_dump() | {"peak": peak, "verdict": verdict})
    assert "120 us" in event.text
    assert f"{percent} %" in event.text
    unseen = ev.ExposureSet.model_validate(EXPOSURE.model_dump() | {"verdict": "unseen", "unit": ""})
    assert "120" in unseen.text
    assert "us" not in unseen.text.split()[:3]


def test_advice_has_percents_and_the_worst_residual_where_there_is_one() -> None:
    for number in ("1.2 %", "5 %", "1250 mm", "0.87 %"):
        assert number in ADVICE.text
    worst = {
        "worst_residual_px": 0.31,
        "worst_residual_sd": 4.2,
        "worst_laser_id": "L3",
        "worst_standoff_mm": 900,
    }
    text = ev.StandoffAdvised.model_validate(ADVICE.model_dump() | worst).text
    assert text.startswith(ADVICE.text)
    for number in ("0.31 px", "4.2 sd", "L3", "900 mm"):
        assert number in text.removeprefix(ADVICE.text)


@pytest.mark.parametrize(("then", "helps"), [(0.0119, True), (0.0122, False), (0.0123, False)])
def test_a_standoff_is_proposed_only_where_it_helps(then: float, helps: bool) -> None:
    advice = ADVICE.model_copy(update={"then_relative_range_sd": then})
    assert advice.next_helps == helps
    assert ("1250 mm" in advice.text) == helps


def test_one_step_is_not_several() -> None:
    lengths = [ev.ProcedureStarted(procedure="p", title="t", steps=n).length for n in (1, 2)]
    assert [length.split() for length in lengths] == [["1", "step"], ["2", "steps"]]


def test_a_placement_set_aside_is_left_out_or_captured_again() -> None:
    texts = {
        left_out: ev.SetAside(key="P3", from_n=4, reason="moved", left_out=left_out).text
        for left_out in (True, False)
    }
    assert texts[True] != texts[False]
    assert all(text.startswith("P3 ") and text.endswith("moved") for text in texts.values())


def test_a_calibration_from_the_future_has_no_negative_age() -> None:
    ages_days = (-1826.0, -0.5, 3.0)
    loaded = [
        ev.CalibrationLoaded(file="c", path="c", sha256="", made="2031-11-30", age_days=age_days)
        for age_days in ages_days
    ]
    future, now, old = (one.text for one in loaded)
    assert "future" in future
    assert "1826" in future
    assert "-" not in now.replace("2031-11-30", "")
    assert "3.0 days old" in old
    assert "future" not in now + old
