"""Prompts and their answers, limits, quality, forecasts: what guides the person at the bench."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from workbench.model import event as ev
from workbench.model.errors import AnswerNeededError, BadInputError
from workbench.model.limit import Limit
from workbench.model.prompt import Action, Answer, Prompt, Quantity
from workbench.model.spot import Failure, Spot
from workbench.model.target import Placement
from workbench.procedure.capture.quality import quality_of
from workbench.procedure.engine.check import check_file
from workbench.procedure.engine.durations import DurationMeter, StepDurations
from workbench.procedure.engine.operator import NoOperator, ScriptedOperator
from workbench.procedure.engine.plan import PlannedStep
from workbench.procedure.engine.progress import TimeLeft
from workbench.procedure.engine.prompts import placement_prompt

ROOT = Path(__file__).parents[4]
NUMBER = Prompt("p", "Read it.", quantity=Quantity("mm", 450.0, 550.0, 500.0), may={"skip": "leave it out"})
CONFIRM = Prompt("safety", "Safe?", at_bench=True)
finite = st.floats(-1e6, 1e6)


@given(finite, finite, finite, finite, finite)
def test_a_limit_is_its_bounds(a: float, b: float, c: float, d: float, value: float) -> None:
    low, inner_low, inner_high, high = sorted((a, b, c, d))
    limit = Limit.model_validate({"in": [low, high], "marginal": [inner_low, inner_high]})
    if not low <= value <= high:
        assert limit.judge(value) == "fail"
    else:
        assert limit.judge(value) == ("pass" if inner_low <= value <= inner_high else "marginal")
    assert Limit.model_validate({"in": [low, None]}).judge(value) == ("pass" if value >= low else "fail")
    assert limit.judge(None) == "fail"


@pytest.mark.parametrize(
    "wrong",
    [
        {"in": [2, 1]},
        {"in": [None, None]},
        {"in": [0, 1], "marginal": [0, 2]},
        {"in": [1, 2], "marginal": [0, 2]},
        {"in": [0, 1], "on_fail": "shrug"},
    ],
)
def test_a_limit_that_makes_no_sense(wrong: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        Limit.model_validate(wrong)


def test_a_measured_standoff_is_as_good_as_a_round_one() -> None:
    assert NUMBER.refuse(Answer(value=502.5)) is None
    assert NUMBER.refuse(Answer(value=450.0)) is None
    assert "450 to 550 mm" in (NUMBER.refuse(Answer(value=440.0)) or "")
    assert NUMBER.refuse(Answer(value="about half a metre")) is not None
    assert NUMBER.refuse(Answer()) is not None


@pytest.mark.parametrize("action", ["redo", "skip", "abort"])
def test_what_loses_data_needs_a_reason(action: Action) -> None:
    prompt = Prompt("p", "Place it.", may={"redo": "again", "skip": "leave it out"})
    assert "reason" in (prompt.refuse(Answer(action=action)) or "")
    assert prompt.refuse(Answer(action=action, reason="it slipped")) is None


def test_what_is_not_possible_here_is_refused() -> None:
    assert NUMBER.refuse(Answer(action="redo", reason="it slipped")) is not None


def test_only_yes_confirms() -> None:
    assert CONFIRM.refuse(Answer()) is None
    assert CONFIRM.refuse(Answer(value="no")) is not None
    assert CONFIRM.refuse(Answer(value="")) is not None


def test_nobody_names_the_prompt() -> None:
    with pytest.raises(AnswerNeededError, match=r"prompt p: Read it.*no terminal") as caught:
        NoOperator("no terminal").ask(NUMBER)
    assert caught.value.exit_code == 6


def by_key(*prompts: Prompt) -> dict[str, Prompt]:
    return {prompt.key: prompt for prompt in prompts}


def test_an_answers_file(tmp_path: Path) -> None:
    path = tmp_path / "answers.yaml"
    path.write_text("p: 502\nsafety: true\nq: {action: skip, reason: no room}\n")
    skipped = Prompt("q", "Place it.", may={"skip": "leave it out"})
    script = ScriptedOperator.load(path, by_key(NUMBER, CONFIRM, skipped), NoOperator("no terminal"))
    assert script.ask(NUMBER) == Answer(value=502.0, by="answers file")
    answer = script.ask(skipped)
    assert (answer.action, answer.reason, answer.by) == ("skip", "no room", "answers file")
    with pytest.raises(
        AnswerNeededError, match=r"prompt safety.*answers it, but on a real rig only somebody"
    ):
        script.ask(CONFIRM)  # it says yes, but has no eyes
    with pytest.raises(AnswerNeededError, match=r"prompt other.*answers.yaml has no answer to it"):
        script.ask(Prompt("other", "?"))


CHOICE = Prompt("card", "Which card?", choices=("1", "yes"))
PLACE = Prompt(
    "p",
    "Place it.",
    quantity=Quantity("mm", 450.0, 550.0, 500.0),
    may={"redo": "again", "skip": "leave it out"},
)
BARE = Prompt(
    "p", "Place it.", quantity=Quantity("mm", 450.0, 550.0), may={"redo": "again", "skip": "leave it out"}
)


@pytest.mark.parametrize(
    ("prompt", "given", "value"),
    [
        (CONFIRM, "true", None),
        (CONFIRM, "yes", None),
        (CHOICE, "yes", "yes"),
        (CHOICE, "1", "1"),
        (PLACE, "true", 500.0),
        (PLACE, "502.5 mm", 502.5),
        (PLACE, "{value: 502}", 502.0),
    ],
)
def test_a_files_answer_is_taken_as_a_persons_would_be(
    tmp_path: Path, prompt: Prompt, given: str, value: float | str | None
) -> None:
    path = tmp_path / "answers.yaml"
    path.write_text(f"{prompt.key}: {given}\n")
    script = ScriptedOperator.load(path, by_key(prompt), NoOperator("no terminal"))
    assert script.answers == {prompt.key: Answer(value=value, by="answers file")}


@pytest.mark.parametrize(
    ("prompt", "given", "says"),
    [
        (PLACE, "half a metre", "expected 450 to 550 mm, got half a metre"),
        (PLACE, "5020", "expected 450 to 550 mm, got 5020.0"),
        (PLACE, ".nan", "expected a finite number"),
        (BARE, "true", "expected 450 to 550 mm, got None"),
        (PLACE, "[500]", "expected true, a number, a choice, or {action: skip, reason: ...}, got [500]"),
        (PLACE, "", "expected true, a number, a choice, or {action: skip, reason: ...}, got nothing"),
        (PLACE, "{action: skip}", "skip loses data: expected a reason with it"),
        (PLACE, "{action: skp}", "expected 'done', 'redo', 'skip' or 'abort', got 'skp'"),
        (PLACE, "{acton: skip}", "no such key; expected one of action, value"),
        (PLACE, "{action: redo, reason: slipped}", "got redo: asked again, the file would say it again"),
        (CHOICE, "green", "expected one of 1, yes, got green"),
        (CONFIRM, "false", "expected true, a number, a choice, or"),
        (CONFIRM, "no", "expected yes, got no"),
    ],
)
def test_an_answer_that_cannot_fit_is_told_with_its_line(
    tmp_path: Path, prompt: Prompt, given: str, says: str
) -> None:
    path = tmp_path / "answers.yaml"
    path.write_text(f"# ours\n{prompt.key}: {given}\n")
    with pytest.raises(BadInputError) as caught:
        ScriptedOperator.load(path, by_key(prompt), NoOperator("no terminal"))
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{path}:2: {prompt.key}")
    assert says in line


@pytest.mark.parametrize(
    ("text", "came"), [("- 1", "no mapping"), ("procedure: p\nsteps: []", "a procedure"), ("rig: r", "a rig")]
)
def test_a_file_of_another_kind_is_no_answers_file(tmp_path: Path, text: str, came: str) -> None:
    path = tmp_path / "answers.yaml"
    path.write_text(text)
    with pytest.raises(BadInputError, match=f":1: expected answers to prompts by their keys, got {came}"):
        ScriptedOperator.load(path, by_key(PLACE), NoOperator("no terminal"))


def test_answers_that_nobody_asks_for_are_told_with_the_nearest_key(tmp_path: Path) -> None:
    path = tmp_path / "answers.yaml"
    path.write_text("card: green\nsafty: true\np: 500\nsafety: true\np: 510\n7: [1]\n")
    with pytest.raises(BadInputError) as caught:
        ScriptedOperator.load(path, by_key(PLACE, CHOICE, CONFIRM), NoOperator("no terminal"))
    lines = str(caught.value).replace(f"{path}:", "").splitlines()
    assert [line.split(":")[0] for line in lines] == ["1", "2", "5", "6"]
    assert lines[1] == "2: safty: nothing of this name is asked; expected one of safety, p, card"
    assert lines[2] == "5: p: stands here again, after line 3; leave one of them"


def spot(u: float, v: float, flags: tuple[Failure, ...] = ()) -> Spot:
    return Spot(
        laser_id=None,
        u_px=u,
        v_px=v,
        u_sd_px=0.05,
        v_sd_px=0.05,
        flux_dn=1,
        width_px=2,
        peak_dn=1,
        flags=frozenset(flags),
    )


def test_quality_is_what_the_repeats_say() -> None:
    u, v = [10.0, 10.2, 10.7], [5.0, 5.1, 5.0]
    found = [[spot(a, b)] for a, b in zip(u, v, strict=True)] + [[], [spot(0, 0), spot(1, 1)]]
    quality = quality_of(found)
    assert quality.repeats == 5
    assert quality.missing == pytest.approx(2 / 5)
    assert quality.snr == pytest.approx(2 / 0.05)
    assert quality.scatter_px == pytest.approx(np.std(u, ddof=1))
    assert (quality.u_px, quality.v_px) == pytest.approx((np.mean(u), np.mean(v)))
    assert quality_of([[spot(0, 0, (Failure.SATURATED,))], [spot(0, 0)]]).saturated == 0.5
    assert quality_of([[]]).snr is None
    assert quality_of([[spot(0, 0)]]).scatter_px is None


def records(*timed: tuple[float, ev.Event]) -> list[ev.Record]:
    return [ev.Record(n=n, time_ns=round(t * 1e9), event=event) for n, (t, event) in enumerate(timed)]


def started(index: int, shots: int) -> ev.StepStarted:
    return ev.StepStarted(procedure="p", index=index, step="s", title="t", shots=shots)


def placed(key: str) -> ev.TargetPlaced:
    return ev.TargetPlaced(placement=Placement(key=key, standoff_mm=500.0))


def taken(key: str, lit_s: float) -> ev.CaptureTaken:
    frame = ev.FrameRef(path="f", sha256="", time_ns=0)
    return ev.CaptureTaken(
        key=key,
        purpose="calibration",
        laser_id="L1",
        placement_key=key[0],
        standoff_mm=500.0,
        repeat=0,
        on=frame,
        lit_s=lit_s,
    )


def shot(at_s: float, key: str, took_s: float = 0.0, lit_s: float = 0.1) -> list[tuple[float, ev.Event]]:
    """A capture, and its spots found `took_s` later."""
    return [(at_s, taken(key, lit_s)), (at_s + took_s, ev.SpotsFound(key=key, spots=()))]


def exposed(key: str) -> ev.ExposureSet:
    return ev.ExposureSet(key=key, exposure=1.0, unit="", peak=0.6, verdict="good", trials=3)


def finished(index: int) -> ev.StepFinished:
    return ev.StepFinished(procedure="p", index=index, outcome="")


def told_by(*timed: tuple[float, ev.Event]) -> DurationMeter:
    meter = DurationMeter()
    for record in records(*timed):
        meter.take(record)
    return meter


TOLD: list[tuple[float, ev.Event]] = [
    (0, started(1, 4)),
    (20, placed("a")),
    *shot(20.5, "a1", 0.5, lit_s=0.1),
    *shot(21.5, "a2", 0.5, lit_s=0.3),
    (22, ev.PlacementFinished(key="a")),
    (62, placed("b")),
    *shot(64.0, "b1", 1.0, lit_s=0.2),
]
STEPS = [PlannedStep("p", 1, "grid", 3, 6), PlannedStep("p", 2, "fit", 0, 0, 7.0)]


def test_pace_is_what_was_measured() -> None:
    """The mean: sums are right."""
    pace = told_by(*TOLD).durations(StepDurations(without_captures_s={"fit": 7.0}))
    assert pace.placing_s == 30.0
    assert pace.capture_s == pytest.approx((1 + 3) / 2), "the first was loading programs"
    assert pace.lit_s == pytest.approx(0.2)
    assert (pace.exposing_s, pace.finishing_s) == (0.0, 0.0), "this camera's exposure is fixed"
    assert pace.seconds(STEPS[1]) == 7.0


def test_a_break_tells_nothing_of_the_next_placing() -> None:
    """Somebody goes to lunch; others take twice as long as usual, and these count."""
    session: list[tuple[float, ev.Event]] = [(0, started(1, 4))]
    at = 0.0
    for n, took in enumerate((20.0, 30.0, 3600.0, 25.0, 50.0, 25.0)):
        at += took
        session.append((at, placed(f"{n}")))
    assert told_by(*session).durations(StepDurations()).placing_s == pytest.approx(
        (20 + 30 + 25 + 50 + 25) / 5
    )


def test_a_plan_takes_as_long_as_the_session_that_told_it() -> None:
    """Nothing that a session does is left out: exposures, advice, each step without shots by itself."""
    fit = ev.StepStarted(procedure="p", index=2, step="fit", title="fit", shots=0)
    export = ev.StepStarted(procedure="p", index=3, step="export", title="export", shots=0)
    meter = told_by(
        (0, started(1, 4)),
        (40, placed("a")),
        (44, exposed("a")),
        *shot(45, "a1", 0.5),
        *shot(46, "a2", 1.0),
        (51, ev.PlacementFinished(key="a")),
        (91, placed("b")),
        (95, exposed("b")),
        *shot(96, "b1", 0.5),
        *shot(97, "b2", 1.0),
        (101, ev.PlacementFinished(key="b")),
        (101, finished(1)),
        (101, fit),
        (131, finished(2)),
        (131, export),
        (132, finished(3)),
    )
    steps = [
        PlannedStep("p", 1, "t", 2, 4),
        PlannedStep("p", 2, "fit", 0, 0),
        PlannedStep("p", 3, "export", 0, 0),
    ]
    pace = meter.durations(StepDurations())
    assert sum(map(pace.seconds, steps)) == pytest.approx(132.0, rel=0.02)
    assert pace.seconds(PlannedStep("p", 1, "place", 1, 0)) == 40.0, "somebody has to place it"


def test_what_a_stop_tore_apart_tells_no_duration() -> None:
    resumed = ev.SessionResumed(from_n=1, operator="", command="", created="")
    meter = told_by((0, started(1, 4)), (20, placed("a")), (9000, resumed), (9001, placed("a")))
    assert meter.durations(StepDurations()).placing_s == 20.0


def test_nor_does_a_question_that_comes_once() -> None:
    """Safety is confirmed before the first placing, and after a resumption; a skipped placement is none."""
    safety = ev.Answered(key="safety", question="?", answer=Answer())
    skip = ev.Answered(key="b", question="?", answer=Answer(action="skip", reason="no room"))
    meter = told_by((0, started(1, 4)), (300, safety), (320, placed("a")), (620, skip), (640, placed("c")))
    assert meter.durations(StepDurations()).placing_s == 20.0
    kept = ev.Answered(key="a/L1/snr", question="Keep?", answer=Answer())
    asked = told_by((0, started(1, 4)), *shot(1, "a1"), (300, kept), (301, ev.PlacementFinished(key="a")))
    assert asked.durations(StepDurations()).finishing_s == StepDurations().finishing_s, (
        "a limit that failed was asked about"
    )
    own = ev.StepStarted(procedure="p", index=1, step="ask", title="Which?", shots=0)
    answered = ev.Answered(key="p.1", question="Which?", answer=Answer(value="grey"))
    assert (
        told_by((0, own), (30, answered), (30, finished(1)))
        .durations(StepDurations())
        .without_captures_s["Which?"]
        == 30.0
    )


def test_what_is_compiled_for_the_first_capture_is_not_expected_again() -> None:
    """Two minutes for the first spots on a computer that has never found any; then 0.1 s."""
    session: list[tuple[float, ev.Event]] = [(0, started(1, 40)), (20, placed("a")), (21, exposed("a"))]
    session += shot(21.1, "a0", 120.0)
    for n in range(1, 20):
        session += shot(141 + n / 10, f"a{n}", 0.1)
    session.append((143.1, ev.PlacementFinished(key="a")))
    forecast = TimeLeft([PlannedStep("p", 1, "grid", 11, 220)], StepDurations())
    for record in records(*session):
        forecast.take(record)
    assert forecast.seconds_left == pytest.approx(10 * (20 + 1 + 20 * 0.1), rel=0.1)


def test_what_other_sessions_told_is_left_step_by_step() -> None:
    """One placing of 90 s does not make a session of half a minute each three times as long."""
    learned = StepDurations(placing_s=30.0, sessions=3)
    session: list[tuple[float, ev.Event]] = [(0, started(1, 4)), (90, placed("a"))]
    assert told_by(*session).durations(learned).placing_s == pytest.approx((2 * 30 + 90) / 3)
    assert told_by(*session).durations(StepDurations()).placing_s == 90.0, "a guess counts for nothing"


def test_the_forecast_counts_placements_and_what_is_left() -> None:
    forecast = TimeLeft(STEPS, StepDurations())
    for record in records(*TOLD):
        forecast.take(record)
    assert (forecast.done, forecast.total) == (2, 3)
    # A placing and three shots of this step, and the fit.
    assert forecast.seconds_left == pytest.approx(30.0 + 3 * 2 + 7.0)


def test_a_placement_repeated_or_left_out_counts_once() -> None:
    again = ev.SetAside(key="b", from_n=8, reason="snr", retry=True)
    out = ev.SetAside(key="b", from_n=8, reason="no room", left_out=True)
    skip = ev.Answered(key="b", question="?", answer=Answer(action="skip", reason="no room"))
    forecast = TimeLeft(STEPS, StepDurations())
    told = []
    retried: list[tuple[float, ev.Event]] = [(65.0, again), (65.0, placed("b")), *shot(66, "b1")]
    for record in records(*TOLD, *retried, (70, out), (70, skip)):
        forecast.take(record)
        told.append(forecast.done)
    assert (forecast.done, forecast.total) == (2, 3)
    assert max(told) == 2
    # A placing and two shots, which took 1, 3 and 1 s, and the fit.
    assert forecast.seconds_left == pytest.approx(30.0 + 2 * 5 / 3 + 7.0)


@pytest.mark.parametrize(
    ("standoff_mm", "before_mm", "may"),
    [
        (900.0, None, {"skip": "leave 900 mm out"}),
        (900.0, 600.0, {"redo": "600 mm again", "skip": "leave 900 mm out"}),
        (900.0, 900.0, {"redo": "the one before", "skip": "leave this one out"}),
    ],
)
def test_a_placement_prompt_says_which_is_captured_again_and_which_left_out(
    standoff_mm: float, before_mm: float | None, may: dict[str, str]
) -> None:
    before = None if before_mm is None else Placement(key="b", standoff_mm=before_mm)
    assert placement_prompt(Placement(key="a", standoff_mm=standoff_mm), before).may == may


HEAD = "format: 1\nprocedure: p\ntitle: P\nsteps:\n"


@pytest.mark.parametrize(
    ("steps", "words"),
    [
        (
            "  - step: capture_grid\n    standoffs_mm: [5]\n    repeats: 0\n",
            ":7: steps[0].repeats: expected at least 1, got 0",
        ),
        ("  - step: dance\n", ":5: steps[0]"),
        (
            "  - step: fit\n  - step: capture_grid\n    standoffs_mm: [5]\n    repeats: 1\n",
            ":5: steps[0]: fit needs",
        ),
        (
            "  - step: capture_grid\n    standoffs_mm: [5]\n    repeats: 1\n"
            "  - step: fit\n  - step: check_limits\n"
            "    limits:\n      rms_px: {in: [0, 1], on_fail: retry}\n",
            "would give the same fit again",
        ),
    ],
)
def test_a_wrong_procedure_is_named_with_its_line(tmp_path: Path, steps: str, words: str) -> None:
    path = tmp_path / "p.yaml"
    path.write_text(HEAD + steps)
    with pytest.raises(BadInputError) as caught:
        check_file(path)
    assert words in str(caught.value)


def test_what_every_file_of_ours_is_worth() -> None:
    for path in [*ROOT.glob("procedures/*.yaml"), *ROOT.glob("rigs/*.yaml")]:
        check_file(path)
    (note,) = check_file(ROOT / "procedures/accuracy-flat.yaml")
    assert "accuracy-flat.yaml:7: steps[0]: accuracy_trial needs a procedure before" in note


def test_a_rig_of_an_unknown_driver(tmp_path: Path) -> None:
    rig = tmp_path / "rig.yaml"
    rig.write_text(
        (ROOT / "rigs/thesis-emulated.yaml").read_text().replace("driver: emulated", "driver: robot")
    )
    with pytest.raises(
        BadInputError, match=r"rig.yaml:6: driver: expected an installed bench driver .*got robot"
    ):
        check_file(rig)
    rig.write_text("lasers: []\n")
    with pytest.raises(BadInputError, match="expected a procedure or a rig"):
        check_file(rig)
