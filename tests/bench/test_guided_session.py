"""Sessions with an operator who does more than say yes, on the virtual bench with its own operator away."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from tests.crash.short import CALLER, RESUMER, go_on, results, story, write_files
from workbench.devices.protocols import Bench, Frame, LaserState, Operator, StreamingCamera
from workbench.devices.registry import open_bench
from workbench.emulator.camera import EmulatedCamera
from workbench.model import event as ev
from workbench.model.arrays import Image
from workbench.model.errors import (
    AnswerNeededError,
    BadInputError,
    LaserOffNotConfirmedError,
    LimitFailedError,
    RigNotReadyError,
    StoppedError,
)
from workbench.model.prompt import Answer, Prompt, Quantity
from workbench.model.rig import Rig, load_rig
from workbench.model.target import Placement
from workbench.procedure.capture.latency import WHOLE, count_latency
from workbench.procedure.doctor import examine
from workbench.procedure.engine.operator import ScriptedOperator
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.resume import resume
from workbench.procedure.engine.run import NO_OPERATOR, run
from workbench.session.journal import Journal, read_journal
from workbench.session.state import effective, session_status

HEAD = "format: 1\nprocedure: p\ntitle: P\nsteps:\n"
GRID = """\
  - step: capture_grid
    standoffs_mm: [300, 600, 1500]
    repeats: 2
"""


class Says:
    """Answers as it was told, in order, and yes once that is over."""

    def __init__(self, *answers: tuple[str, Answer]) -> None:
        self.answers = list(answers)
        self.asked: list[Prompt] = []

    def ask(self, prompt: Prompt) -> Answer:
        self.asked.append(prompt)
        if self.answers and self.answers[0][0] == prompt.key:
            answer = self.answers.pop(0)[1]
        else:
            answer = Answer(value=None if prompt.quantity is None else prompt.quantity.usual)
        assert prompt.refuse(answer) is None
        return answer


class Foreseen:
    """Holds every prompt that comes against those foreseen, which answers files are held against."""

    def __init__(self, other: Operator, foreseen: dict[str, Prompt]) -> None:
        self.other, self.foreseen = other, foreseen

    def ask(self, prompt: Prompt) -> Answer:
        before = self.foreseen[prompt.key]
        assert (before.quantity, before.choices, before.at_bench) == (
            prompt.quantity,
            prompt.choices,
            prompt.at_bench,
        )
        assert set(before.may) >= set(prompt.may)
        return self.other.ask(prompt)


def session(folder: Path, steps: str, operator: Operator, emulator: str = "") -> Path:
    """Run a procedure; the bench's own operator is away."""
    folder.mkdir(exist_ok=True)
    rig, procedure = write_files(folder, HEAD + steps)
    rig.write_text(rig.read_text() + "  answers: false\n" + emulator)
    plan = Plan.load(rig, [procedure])
    held = Foreseen(operator, plan.prompts())
    run(plan, folder / "s", (), CALLER, lambda: None, held)
    return folder / "s"


def events(folder: Path, kind: type[ev.Event]) -> list[ev.Event]:
    return [r.event for r in effective(read_journal(folder)) if isinstance(r.event, kind)]


def test_each_prompt_comes_once_and_safety_first(tmp_path: Path) -> None:
    operator = Says()
    done = session(tmp_path, GRID, operator)
    assert [p.key for p in operator.asked] == ["safety", "p.1/300mm", "p.1/600mm", "p.1/1500mm"]
    assert all(p.at_bench and p.otherwise for p in operator.asked)
    assert "class" in operator.asked[0].do
    assert [e.by for e in events(done, ev.TargetPlaced) if isinstance(e, ev.TargetPlaced)] == ["person"] * 3


def test_a_placement_captured_again_leaves_no_trace_in_the_result(tmp_path: Path) -> None:
    plain = session(tmp_path / "plain", GRID, Says())
    redo = Says(("p.1/600mm", Answer(action="redo", reason="it slipped")))
    again = session(tmp_path / "again", GRID, redo)
    assert [p.key for p in redo.asked][1:] == [f"p.1/{mm}mm" for mm in (300, 600, 300, 600, 1500)]
    told = [e for e in events(again, ev.SetAside) if isinstance(e, ev.SetAside)]
    assert [(e.key, e.reason) for e in told] == [("p.1/300mm", "it slipped")]
    assert [e for e in story(again) if not isinstance(e, ev.SetAside)] == story(plain)
    assert results(again) == results(plain)
    assert len(list((again / "set-aside/1/p.1/300mm").rglob("*.png"))) == 8


def test_a_placement_left_out_is_told_with_its_reason(tmp_path: Path) -> None:
    done = session(tmp_path, GRID, Says(("p.1/600mm", Answer(action="skip", reason="no room"))))
    placed = [
        e.placement.standoff_mm for e in events(done, ev.TargetPlaced) if isinstance(e, ev.TargetPlaced)
    ]
    assert placed == [300.0, 1500.0]
    skipped = [e for e in events(done, ev.Answered) if isinstance(e, ev.Answered) and e.key != "safety"]
    assert [(e.key, e.answer.reason) for e in skipped] == [("p.1/600mm", "no room")]


def test_a_measured_standoff_counts_as_measured(tmp_path: Path) -> None:
    """The bench puts the target where the operator read it: the ranges found with it are those."""
    read = Says(("p.1/600mm", Answer(value=612.5)))
    steps = GRID + "  - step: fit\n    limits: {max_relative_range_sd: 0.5}\n"
    done = session(tmp_path, steps, read)
    table = (done / "captures.csv").read_text()
    assert table.count(",612.5,") == 4
    (fit,) = [e for e in events(done, ev.FitFinished) if isinstance(e, ev.FitFinished)]
    assert fit.verdict == "accepted"
    assert fit.rms_px < 0.3  # at 600 mm its spots would lie 1.1 px off


def test_abort_says_who_and_why(tmp_path: Path) -> None:
    with pytest.raises(StoppedError, match=r"aborted by the operator at p.1/600mm: fire drill"):
        session(tmp_path, GRID, Says(("p.1/600mm", Answer(action="abort", reason="fire drill"))))
    assert session_status(tmp_path / "s").state == "stopped"


def test_nobody_at_a_real_rig_and_then_somebody(tmp_path: Path) -> None:
    answers = tmp_path / "answers.yaml"
    answers.write_text("safety: true\np.1/300mm: 300\n")
    foreseen = (Prompt("safety", "?"), Prompt("p.1/300mm", "?", quantity=Quantity("mm", 270, 330)))
    with pytest.raises(AnswerNeededError, match="prompt safety"):
        session(tmp_path, GRID, ScriptedOperator.load(answers, {p.key: p for p in foreseen}, NO_OPERATOR))
    assert not list((tmp_path / "s/frames").iterdir()), "nothing was lit"
    waiting = session_status(tmp_path / "s")
    assert (waiting.state, waiting.unfinished) == ("waiting", True)
    assert waiting.why.startswith("for an answer to safety: Lasers will be switched on")
    assert "nobody" not in waiting.why
    operator = Says()
    resume(tmp_path / "s", (), RESUMER, lambda: None, operator)
    assert [p.key for p in operator.asked][:2] == ["safety", "p.1/300mm"]
    assert session_status(tmp_path / "s").state == "finished"


def test_a_session_whose_folder_was_renamed(tmp_path: Path) -> None:
    with pytest.raises(StoppedError):
        session(tmp_path, GRID, Says(("p.1/600mm", Answer(action="abort", reason="lunch"))))
    renamed = (tmp_path / "s").rename(tmp_path / "mine")
    with pytest.raises(BadInputError, match=r"mine: .*\bs\b"):
        resume(renamed, (), RESUMER, lambda: None, Says())


def test_a_resumed_session_asks_for_safety_and_the_placement_under_way(tmp_path: Path) -> None:
    with pytest.raises(StoppedError):
        session(tmp_path, GRID, Says(("p.1/1500mm", Answer(action="abort", reason="lunch"))))
    operator = Says()
    resume(tmp_path / "s", (), RESUMER, lambda: None, operator)
    assert [p.key for p in operator.asked] == ["safety", "p.1/1500mm"]


QUESTIONS = """\
  - {step: confirm, text: Close the door., expect: The lamp is green., otherwise: Call somebody.}
  - {step: ask, text: Room temperature?, number: {unit: degC, in: [10, 40]}}
  - {step: ask, text: Which card?, choices: [white, grey]}
"""


def test_questions_are_kept_and_not_asked_again(tmp_path: Path) -> None:
    said = Says(
        ("p.2", Answer(value=21.5)),
        ("p.3", Answer(value="grey")),
        ("p.4/300mm", Answer(action="abort", reason="lunch")),
    )
    with pytest.raises(StoppedError):
        session(tmp_path, QUESTIONS + GRID, said)
    operator = Says()
    resume(tmp_path / "s", (), RESUMER, lambda: None, operator)
    assert operator.asked[0].key == "safety"
    kept = [e for e in events(tmp_path / "s", ev.Answered) if isinstance(e, ev.Answered)]
    assert [e.answer.value for e in kept if e.key in {"p.1", "p.2", "p.3"}] == [None, 21.5, "grey"]


def limited(quantity: str, limit: str) -> str:
    return GRID + f"    limits:\n      {quantity}: {limit}\n"


def test_retry_captures_again_twice_and_then_stops(tmp_path: Path) -> None:
    with pytest.raises(LimitFailedError, match=r"p.1/300mm/L1: snr: expected at least 1e\+09, got"):
        session(tmp_path, limited("snr", "{in: [1.0e9, null], on_fail: retry}"), Says())
    every = [r.event for r in read_journal(tmp_path / "s")]
    assert sum(isinstance(e, ev.SetAside) for e in every) == 2
    assert sum(isinstance(e, ev.CaptureTaken) for e in every) == 3 * 4
    assert sorted(p.name for p in (tmp_path / "s/set-aside").iterdir()) == ["1", "2"]


def test_a_resumption_grants_no_retries_beyond_the_sessions(tmp_path: Path) -> None:
    """The first session is stopped after one retry, the second after the other: what is left is one look."""
    steps = limited("snr", "{in: [1.0e9, null], on_fail: retry}")
    rig, procedure = write_files(tmp_path, HEAD + steps)
    rig.write_text(rig.read_text() + "  answers: false\n")
    stopped = tmp_path / "s"

    def after(retries: int) -> Callable[[], str | None]:
        def stopping() -> str | None:
            every = [r.event for r in read_journal(stopped)] if (stopped / "journal.jsonl").exists() else []
            return "lunch" if sum(isinstance(e, ev.SetAside) for e in every) == retries else None

        return stopping

    with pytest.raises(StoppedError, match="lunch"):
        run(Plan.load(rig, [procedure]), stopped, (), CALLER, after(1), Says())
    with pytest.raises(StoppedError, match="lunch"):
        resume(stopped, (), RESUMER, after(2), Says())
    for _ in range(2):
        with pytest.raises(LimitFailedError, match="snr"):
            resume(stopped, (), RESUMER, lambda: None, Says())
    told = [r.event for r in read_journal(stopped) if isinstance(r.event, ev.SetAside)]
    assert [(e.key, e.retry) for e in told] == [("p.1/300mm", True)] * 2


def test_ask_lets_the_operator_keep_redo_or_leave_out(tmp_path: Path) -> None:
    operator = Says(
        ("p.1/300mm/L1/snr", Answer(action="redo", reason="wiped the lens")),
        ("p.1/300mm/L1/snr", Answer()),
        ("p.1/300mm/L4/snr", Answer()),
        ("p.1/600mm/L1/snr", Answer(action="skip", reason="hopeless")),
    )
    done = session(tmp_path, limited("snr", "{in: [1.0e9, null], on_fail: ask}"), operator)
    assert operator.answers == []
    places = {e.placement_key for e in events(done, ev.CaptureTaken) if isinstance(e, ev.CaptureTaken)}
    assert places == {"p.1/300mm", "p.1/1500mm"}
    told = [e.reason for e in events(done, ev.SetAside) if isinstance(e, ev.SetAside)]
    assert [reason.rpartition(": ")[2] for reason in told] == ["wiped the lens", "hopeless"]
    words = [e.text for e in events(done, ev.SetAside) if isinstance(e, ev.SetAside)]
    assert words[0].startswith("p.1/300mm is captured again: ")
    assert words[1] == "p.1/600mm is skipped: hopeless"


def test_a_marginal_value_is_told_and_gone_on_from(tmp_path: Path) -> None:
    done = session(tmp_path, limited("snr", "{in: [1, null], marginal: [1.0e9, null]}"), Says())
    verdicts = {e.verdict for e in events(done, ev.LimitChecked) if isinstance(e, ev.LimitChecked)}
    assert verdicts == {"marginal"}
    assert session_status(done).state == "finished"


FIT = GRID + "  - step: fit\n    limits: {max_relative_range_sd: 0.5}\n"


@pytest.mark.long_cases
@pytest.mark.parametrize(("step", "quantity"), [("check_limits", "rms_px"), ("validate", "worst_z")])
def test_a_fit_is_held_against_limits(tmp_path: Path, step: str, quantity: str) -> None:
    def with_limit(limit: str) -> str:
        return FIT + f"  - {{step: {step}, limits: {{{quantity}: {limit}}}}}\n"

    done = session(tmp_path / "good", with_limit("{in: [0, 6]}"), Says())
    assert [e.verdict for e in events(done, ev.LimitChecked) if isinstance(e, ev.LimitChecked)] == ["pass"]
    with pytest.raises(LimitFailedError, match=f"fit: {quantity}: expected 0 to 1e-09"):
        session(tmp_path / "bad", with_limit("{in: [0, 1.0e-9]}"), Says())
    operator = Says((f"p.3/{quantity}", Answer()))
    done = session(tmp_path / "asked", with_limit("{in: [0, 1.0e-9], on_fail: ask}"), operator)
    assert operator.answers == []
    assert session_status(done).state == "finished"


UNSEEN = """\
  - step: capture_grid
    standoffs_mm: [210, 160, 125]
    repeats: 2
    limits:
      missing: {in: [null, 0.5], on_fail: ask}
      snr: {in: [8, null], on_fail: ask}
      scatter_px: {in: [null, 0.2], on_fail: ask}
"""


def test_a_laser_out_of_the_picture_is_asked_about_once_and_in_words(tmp_path: Path) -> None:
    """At 125 mm the spot of this bench's L4 lies at u = 654 px of 640."""
    operator = Says()
    done = session(tmp_path, UNSEEN, operator)
    (asked,) = [p for p in operator.asked if "/L4/" in p.key]
    assert asked.key == "p.1/125mm/L4/missing"
    assert asked.do.startswith(
        "no spot of L4 was found in 2 captures at 125 mm (missing: expected at most 0.5). "
    )
    assert "outside the image of 640 x 480" in asked.expect
    assert asked.yes
    assert asked.may == {"redo": "125 mm again", "skip": "leave 125 mm out"}
    failed = [e for e in events(done, ev.LimitChecked) if isinstance(e, ev.LimitChecked)]
    assert [e.quantity for e in failed if e.verdict == "fail"] == ["missing", "snr", "scatter_px"]


def test_a_limit_that_stops_says_so_as_well(tmp_path: Path) -> None:
    only = UNSEEN[: UNSEEN.index("      missing")] + "      snr: {in: [8, null]}\n"
    with pytest.raises(
        LimitFailedError,
        match=r"p.1/125mm/L4: snr: .* no spot of L4 was found in 2 captures\. .* outside the image",
    ):
        session(tmp_path, only, Says())


LATENCY = "  - {step: place_target, standoff_mm: 500}\n  - step: measure_latency\n" + GRID


def test_a_procedure_measures_the_latency(tmp_path: Path) -> None:
    done = session(tmp_path, LATENCY, Says(), "  camera: {latency_frames: 3}\n")
    assert events(done, ev.LatencyMeasured) == [ev.LatencyMeasured(frames=3)]


def too_hopeful(rig: Rig, session_dir: Path) -> Bench:
    """The rig's bench, whose driver believes in three frames less than there are."""
    bench = open_bench(rig, session_dir)
    assert isinstance(bench.camera, StreamingCamera)
    bench.camera.discard_frames -= 3
    return bench


def test_an_exposure_is_searched_for_on_frames_that_are_not_stale(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever the rig file says of the latency: its measurement comes first, and rests on no search."""
    late = "  camera: {latency_frames: 3}\n"
    right = session(tmp_path / "right", LATENCY, Says(), late)
    monkeypatch.setattr("workbench.procedure.engine.run.open_bench", too_hopeful)
    hopeful = session(tmp_path / "hopeful", LATENCY, Says(), late)
    assert events(hopeful, ev.LatencyMeasured) == [ev.LatencyMeasured(frames=3)]
    found = [e for e in events(hopeful, ev.ExposureSet) if isinstance(e, ev.ExposureSet)]
    assert [e.key for e in found] == ["p.3/300mm", "p.3/600mm", "p.3/1500mm"]
    assert {e.verdict for e in found} == {"good"}
    assert found == events(right, ev.ExposureSet)
    # The test can fail: without the measurement every trial sees the lasers as they were before.
    with pytest.raises(LaserOffNotConfirmedError, match=r"shows a spot .* measure_latency"):
        session(tmp_path / "stale", GRID, Says(), late)
    assert [
        e.verdict for e in events(tmp_path / "stale/s", ev.ExposureSet) if isinstance(e, ev.ExposureSet)
    ] == ["unseen"]


def test_the_doctor_looks_at_the_latency_first(tmp_path: Path) -> None:
    rig_file, _ = write_files(tmp_path)
    rig_file.write_text(rig_file.read_text() + "  camera: {latency_frames: 3}\n")
    rig = load_rig(rig_file)
    with too_hopeful(rig, tmp_path / "s") as bench:
        found = {finding.part: finding for finding in examine(rig, bench, Says())}
    assert [part for part, finding in found.items() if not finding.ok] == ["latency"]
    assert "3 frames" in found["latency"].found
    assert "measure_latency" in found["latency"].found


@pytest.mark.parametrize("exposure_s", [2e-6, 0.033])
def test_latency_is_counted_whatever_the_exposure_was(tmp_path: Path, exposure_s: float) -> None:
    """Too dim to be seen at 2.5 m, or the room clipped: others are tried, far apart."""
    rig_file, _ = write_files(tmp_path)
    emulator = "  camera: {latency_frames: 3}\n  ambient: {level_e_per_s: 2.0e6}\n"
    rig_file.write_text(rig_file.read_text() + emulator)
    rig = load_rig(rig_file)
    with open_bench(rig, tmp_path / "s") as bench:
        assert isinstance(bench.camera, EmulatedCamera)
        bench.camera.exposure_s = exposure_s
        bench.target.place(Placement(key="k", standoff_mm=2500.0))
        bench.mark("k")
        assert count_latency(bench.lasers, bench.camera, rig, 10) == 3
        assert bench.camera.exposure_s != exposure_s, "it saw nothing at first"


@pytest.mark.long_cases
@pytest.mark.parametrize("latency", [0, 1, 4])
def test_latency_is_counted_whatever_the_driver_believes(tmp_path: Path, latency: int) -> None:
    rig_file, _ = write_files(tmp_path)
    rig_file.write_text(rig_file.read_text() + f"  camera: {{latency_frames: {latency}}}\n")
    rig = load_rig(rig_file)
    with open_bench(rig, tmp_path / "s") as bench:
        bench.target.place(Placement(key="k", standoff_mm=500.0))
        bench.mark("k")
        assert isinstance(bench.camera, StreamingCamera)
        assert count_latency(bench.lasers, bench.camera, rig, 10) == latency
        if latency > 1:
            with pytest.raises(RigNotReadyError, match="L1 within 1 frames"):
                count_latency(bench.lasers, bench.camera, rig, 1)


class Clocked:
    """A camera that runs freely, and its laser; time passes while a frame is waited for, or somebody sleeps.

    Frame n was exposed for `exposure` until `delay` before it comes, at n (times: frames).
    """

    discard_frames = 0

    def __init__(self, exposure: float, delay: float) -> None:
        self._exposure, self._delay = exposure, delay
        self.now = 0.0
        self._on: list[tuple[float, float]] = []
        self._rng = np.random.default_rng(1)
        v, u = np.mgrid[:480, :640]
        self._spot = 150.0 * np.exp(-((u - 200) ** 2 + (v - 240) ** 2) / (2 * 1.5**2))

    def monotonic(self) -> float:
        return self.now

    def sleep(self, frames: float) -> None:
        self.now += frames

    @contextmanager
    def lit(self, ids: Sequence[str], for_s: float) -> Iterator[None]:
        self._on.append((self.now, math.inf))
        yield
        self._on[-1] = (self._on[-1][0], self.now)

    def all_off(self) -> None:
        pass

    def share(self) -> float:
        """Of its exposure for which the frame that comes next is lit; waits for it."""
        self.now = math.floor(self.now + 1 + 1e-9)
        end = self.now - self._delay
        lit = sum(max(0.0, min(off, end) - max(on, end - self._exposure)) for on, off in self._on)
        return lit / self._exposure

    def read(self) -> Frame:
        light = 8.0 + self.share() * self._spot + self._rng.normal(0.0, 1.5, (480, 640))
        image: Image = np.clip(np.rint(light), 0, 255).astype(np.uint8)
        return Frame(image, 0)

    grab = grab_ambient = read
    ids: tuple[str, ...] = ("L1", "L4")
    identity = "clocked"

    def beat(self) -> None:
        pass

    def state(self) -> LaserState:
        return LaserState((), None)

    def close(self) -> None:
        pass


@pytest.mark.parametrize(
    ("exposure", "delay"), [(0.17, 0.0), (0.17, 0.33), (0.17, 0.67), (0.9, 0.0), (0.9, 0.5), (0.5, 2.2)]
)
def test_frames_older_than_the_latency_are_lit_whenever_the_laser_is_switched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, exposure: float, delay: float
) -> None:
    rig_file, _ = write_files(tmp_path)
    camera = Clocked(exposure, delay)
    monkeypatch.setattr("workbench.procedure.capture.latency.time", camera)
    counted = count_latency(camera, camera, load_rig(rig_file), 10)
    assert counted == math.ceil(exposure + delay)
    worst = 1.0
    for phase in np.random.default_rng(2).random(200):
        camera.sleep(3 + phase)
        with camera.lit(["L1"], 2.0):
            for _ in range(counted):
                camera.share()
            worst = min(worst, camera.share())
    assert worst >= WHOLE


@pytest.mark.long_cases
@pytest.mark.parametrize(
    ("emulator", "bad"),
    [
        ("", set()),
        ("  camera: {exposure_s: 1.0e-5}\n", {"laser L1", "laser L4"}),
        ("  camera: {exposure_s: 0.03}\n", {"laser L1", "laser L4"}),
        ("  truth: {lasers: {L4: {x_mm: 400}}}\n", {"laser L4"}),
        (
            "  truth: {lasers: {L1: {x_mm: 400}, L4: {x_mm: 400}}}\n  ambient: {level_e_per_s: 2.0e6}\n",
            {"latency", "exposure", "laser L1", "laser L4"},  # the room is no spot
        ),
    ],
)
def test_the_doctor_finds_what_is_wrong(tmp_path: Path, emulator: str, bad: set[str]) -> None:
    rig_file, _ = write_files(tmp_path)
    rig_file.write_text(rig_file.read_text() + emulator)
    rig = load_rig(rig_file)
    with open_bench(rig, tmp_path / "s") as bench:
        found = list(examine(rig, bench, Says()))
    assert {finding.part for finding in found if not finding.ok} == bad
    fixed = "exposure_s" in emulator
    exposure = [] if fixed else ["exposure"]
    automatic = [*exposure, "automatic control"]
    parts = ["controller", "interlock", "camera", "latency", *automatic, "laser L1", "laser L4"]
    assert [f.part for f in found] == parts


def stopped_session(folder: Path) -> Path:
    with pytest.raises(StoppedError):
        session(folder, GRID, Says(("p.1/600mm", Answer(action="abort", reason="lunch"))))
    return folder / "s"


def change(old: str, new: str) -> Callable[[Path], None]:
    def edit(path: Path) -> None:
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))

    return edit


def test_a_stop_while_it_goes_over_what_is_there_takes_nothing_away(tmp_path: Path) -> None:
    """Answers given before are not asked for again, and the journal does not grow by what it has already."""
    steps = GRID + "  - {step: ask, text: Which card?, choices: [white, grey]}\n" + GRID
    said = Says(("p.2", Answer(value="grey")), ("p.3/600mm", Answer(action="abort", reason="lunch")))
    with pytest.raises(StoppedError, match="lunch"):
        session(tmp_path, steps, said)
    stopped = tmp_path / "s"
    before = effective(read_journal(stopped))
    for _ in range(2):
        with pytest.raises(StoppedError, match="at once"):
            resume(stopped, (), RESUMER, lambda: "at once", Says())
    counted = [record.n for record in effective(read_journal(stopped))]
    assert [record.n for record in before if not isinstance(record.event, ev.SessionFinished)] == [
        n for n in counted if n <= before[-1].n
    ]
    later = Says()
    resume(stopped, (), RESUMER, lambda: None, later)
    assert [prompt.key for prompt in later.asked] == ["safety", "p.3/600mm", "p.3/1500mm"]
    assert session_status(stopped).state == "finished"


def test_a_comment_is_no_change(tmp_path: Path) -> None:
    stopped = stopped_session(tmp_path)
    change("serial: emulated-1", "serial: emulated-1  # by the window")(tmp_path / "rig.yaml")
    resume(stopped, (), RESUMER, lambda: None, Says())
    assert session_status(stopped).state == "finished"


@pytest.mark.long_cases
@pytest.mark.parametrize(
    ("file", "edit"),
    [
        ("rig.yaml", change("sd: 26.7", "sd: 20.0")),
        ("p.yaml", change("[300, 600, 1500]", "[300, 600, 1400]")),
    ],
)
def test_a_change_is_refused_unless_it_is_accepted(
    tmp_path: Path, file: str, edit: Callable[[Path], None]
) -> None:
    stopped = stopped_session(tmp_path)
    edit(tmp_path / file)
    before = (stopped / "journal.jsonl").read_bytes()
    with pytest.raises(BadInputError, match=f"{file} has changed since.*\n.*accept-changes"):
        resume(stopped, (), RESUMER, lambda: None, Says())
    assert (stopped / "journal.jsonl").read_bytes() == before
    resume(stopped, (), RESUMER, lambda: None, Says(), "a typing error")
    (resumed,) = [e for e in events(stopped, ev.SessionResumed) if isinstance(e, ev.SessionResumed)]
    assert resumed.accepted_because == "a typing error"
    assert file in resumed.changes[0]
    assert session_status(stopped).state == "finished"
    assert (tmp_path / file).read_text() in _texts(stopped / "session.yaml")
    assert (tmp_path / file).read_text() not in _texts(stopped / "session-1.yaml")


def test_what_a_resumed_session_captures_again_is_asked_for_first(tmp_path: Path) -> None:
    """Nobody knows where the target stands by now, nor who stands in the beams."""
    stopped = stopped_session(tmp_path)
    tighter = "repeats: 2\n    limits:\n      snr: {in: [1.0e9, null], on_fail: retry}"
    change("repeats: 2", tighter)(tmp_path / "p.yaml")
    operator = Says()
    with pytest.raises(LimitFailedError, match=r"p.1/300mm/L1: snr"):
        resume(stopped, (), RESUMER, lambda: None, operator, "brighter spots are asked for")
    assert [prompt.key for prompt in operator.asked] == ["safety", "p.1/300mm"]


def _texts(manifest: Path) -> list[str]:
    import yaml

    data = yaml.safe_load(manifest.read_text())
    return [data["rig"]["text"], *(p["text"] for p in data["procedures"])]


def test_another_rig_is_another_session(tmp_path: Path) -> None:
    stopped = stopped_session(tmp_path)
    change("rig: thesis-emulated", "rig: other")(tmp_path / "rig.yaml")
    with pytest.raises(BadInputError, match="other"):
        resume(stopped, (), RESUMER, lambda: None, Says(), "why not")


def test_what_is_finished_or_running_is_not_resumed(tmp_path: Path) -> None:
    done = session(tmp_path / "done", GRID, Says())
    with pytest.raises(BadInputError, match="finished"):
        go_on(done)
    stopped = stopped_session(tmp_path / "stopped")
    with Journal.reopen(stopped)[0]:
        assert session_status(stopped).state == "running"
        with pytest.raises(BadInputError, match="another program"):
            go_on(stopped)


def test_a_frame_that_has_changed_is_not_taken(tmp_path: Path) -> None:
    stopped = stopped_session(tmp_path)
    frames = sorted((stopped / "frames/p.1/300mm").rglob("*.png"))
    frames[0].write_bytes(frames[1].read_bytes())
    with pytest.raises(BadInputError, match="has changed since it was captured"):
        go_on(stopped)
