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
from workbench.model.target import Placement
from workbench.procedure.check import check_file
from workbench.procedure.operator import Nobody, Scripted
from workbench.procedure.outline import Forecast, Pace, PaceMeter, PlannedStep
from workbench.procedure.quality import quality_of

ROOT = Path(__file__).parents[2]
NUMBER = Prompt("p", "Read it.", quantity=Quantity("mm", 450.0, 550.0, 500.0), may=("skip",))
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
    prompt = Prompt("p", "Place it.", may=("redo", "skip"))
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
        Nobody("no terminal").ask(NUMBER)
    assert caught.value.exit_code == 6


def by_key(*prompts: Prompt) -> dict[str, Prompt]:
    return {prompt.key: prompt for prompt in prompts}


def test_an_answers_file(tmp_path: Path) -> None:
    path = tmp_path / "answers.yaml"
    path.write_text("p: 502\nsafety: true\nq: {action: skip, reason: no room}\n")
    skipped = Prompt("q", "Place it.", may=("skip",))
    script = Scripted.load(path, by_key(NUMBER, CONFIRM, skipped), Nobody("no terminal"))
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
PLACE = Prompt("p", "Place it.", quantity=Quantity("mm", 450.0, 550.0, 500.0), may=("redo", "skip"))
BARE = Prompt("p", "Place it.", quantity=Quantity("mm", 450.0, 550.0), may=("redo", "skip"))


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
    script = Scripted.load(path, by_key(prompt), Nobody("no terminal"))
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
        Scripted.load(path, by_key(prompt), Nobody("no terminal"))
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{path}:2: {prompt.key}")
    assert says in line


def test_answers_that_nobody_asks_for_are_told_with_the_nearest_key(tmp_path: Path) -> None:
    path = tmp_path / "answers.yaml"
    path.write_text("card: green\nsafty: true\np: 500\nsafety: true\np: 510\n7: 1\n")
    with pytest.raises(BadInputError) as caught:
        Scripted.load(path, by_key(PLACE, CHOICE, CONFIRM), Nobody("no terminal"))
    lines = str(caught.value).replace(f"{path}:", "").splitlines()
    assert [line.split(":")[0] for line in lines] == ["1", "2", "5", "6"]
    assert lines[1] == "2: safty: nothing of this name is asked; expected one of safety, p, card"
    assert lines[2] == "5: p: stands here again, after line 3; leave one of them"


def spot(u: float, v: float, flags: tuple[str, ...] = ()) -> ev.SpotRecord:
    return ev.SpotRecord(
        laser_id=None,
        u_px=u,
        v_px=v,
        u_sd_px=0.05,
        v_sd_px=0.05,
        flux_dn=1,
        width_px=2,
        peak_dn=1,
        flags=flags,
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
    assert quality_of([[spot(0, 0, ("saturated",))], [spot(0, 0)]]).saturated == 0.5
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


TOLD = records(
    (0, started(1, 4)),
    (20, placed("a")),
    (21, taken("a1", 0.1)),
    (22, taken("a2", 0.3)),
    (22, ev.PlacementFinished(key="a")),
    (62, placed("b")),
    (65, taken("b1", 0.2)),
)
STEPS = [PlannedStep("p", 1, "grid", 3, 6), PlannedStep("p", 2, "fit", 0, 0, 7.0)]


def test_pace_is_what_was_measured() -> None:
    """Of placings the median, since somebody may go to lunch; of the rest the mean: sums are right."""
    meter = PaceMeter()
    for record in TOLD:
        meter.take(record)
    pace = meter.pace(Pace(without_shots_s={"fit": 7.0}))
    assert pace.placing_s == 30.0
    assert pace.shot_s == pytest.approx(5 / 3)
    assert pace.lit_s == pytest.approx(0.2)
    assert (pace.exposing_s, pace.finishing_s) == (0.0, 0.0), "this camera's exposure is fixed"
    assert pace.seconds(STEPS[1]) == 7.0


def test_a_plan_takes_as_long_as_the_session_that_told_it() -> None:
    """Nothing that a session does is left out: exposures, advice, each step without shots by itself."""
    fit = ev.StepStarted(procedure="p", index=2, step="fit", title="fit", shots=0)
    export = ev.StepStarted(procedure="p", index=3, step="export", title="export", shots=0)
    exposure = ev.ExposureSet(key="a", exposure=1.0, unit="", peak=0.6, verdict="good", trials=3)
    told = records(
        (0, started(1, 4)),
        (40, placed("a")),
        (45, exposure),
        (48, taken("a1", 0.1)),
        (49, taken("a2", 0.1)),
        (51, ev.PlacementFinished(key="a")),
        (91, placed("b")),
        (94, exposure),
        (95, taken("b1", 0.1)),
        (96, taken("b2", 0.1)),
        (102, ev.PlacementFinished(key="b")),
        (102, ev.StepFinished(procedure="p", index=1, outcome="")),
        (102, fit),
        (132, ev.StepFinished(procedure="p", index=2, outcome="")),
        (132, export),
        (133, ev.StepFinished(procedure="p", index=3, outcome="")),
    )
    meter = PaceMeter()
    for record in told:
        meter.take(record)
    steps = [
        PlannedStep("p", 1, "t", 2, 4),
        PlannedStep("p", 2, "fit", 0, 0),
        PlannedStep("p", 3, "export", 0, 0),
    ]
    pace = meter.pace(Pace())
    assert sum(map(pace.seconds, steps)) == pytest.approx(133.0)
    assert pace.seconds(PlannedStep("p", 1, "place", 1, 0)) == 40.0, "somebody has to place it"


def test_what_a_stop_tore_apart_tells_no_duration() -> None:
    resumed = ev.SessionResumed(from_n=1, operator="", command="", created="")
    meter = PaceMeter()
    for record in records((0, started(1, 4)), (20, placed("a")), (9000, resumed), (9001, placed("a"))):
        meter.take(record)
    assert meter.pace(Pace()).placing_s == 20.0


def test_the_forecast_counts_placements_and_what_is_left() -> None:
    forecast = Forecast(STEPS, Pace())
    for record in TOLD:
        forecast.take(record)
    assert (forecast.done, forecast.total) == (2, 4)
    # A placing and three shots of this step, and the fit.
    assert forecast.seconds_left == pytest.approx(30.0 + 3 * 5 / 3 + 7.0)


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
