"""The context of a running step: questions, captures, stops."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.running import Running, Scripted, running, two_laser_rig, with_emulator
from workbench.calibration.data.spot_rows import prior_scanline
from workbench.devices.protocols import Frame, StreamingCamera
from workbench.model.errors import AnswerNeededError, RigNotReadyError, StoppedError
from workbench.model.event import Answered, CaptureTaken, LatencyMeasured
from workbench.model.prompt import Action, Answer, Prompt
from workbench.procedure.engine.step import flat_placement
from workbench.session.frames import read_image

PROMPT = Prompt("p.1", "Open the door.")
PLACEMENT = flat_placement("p.2", 500.0)


def capture(session: Running, key: str, scene: str | None = None) -> None:
    context = session.context
    lines = [prior_scanline(context.rig, context.rig.lasers[0])]
    context.capture(key, ["L1"], PLACEMENT, 0, lines, scene)


def test_an_answer_is_journalled_with_its_question(tmp_path: Path) -> None:
    with running(tmp_path, operator=Scripted({"p.1": [Answer(value="grey")]})) as session:
        assert session.context.ask(PROMPT).value == "grey"
        assert session.events == [Answered(key="p.1", question="Open the door.", answer=Answer(value="grey"))]


@pytest.mark.parametrize(("overrules", "action"), [(True, "done"), (True, "redo"), (False, "done")])
def test_only_a_confirmation_in_spite_of_a_failed_check_overrules_it(
    tmp_path: Path, overrules: bool, action: Action
) -> None:
    prompt = replace(PROMPT, overrules=overrules, may={"redo": "again"})
    with running(tmp_path, operator=Scripted({"p.1": [Answer(action=action, reason="x")]})) as session:
        session.context.ask(prompt)
        (answered,) = session.events
        assert isinstance(answered, Answered)
        assert answered.overrules == (overrules and action == "done")


def test_an_abort_stops_the_session_with_its_reason(tmp_path: Path) -> None:
    operator = Scripted({"p.1": [Answer(action="abort", reason="smoke")]})
    with running(tmp_path, operator=operator) as session:
        with pytest.raises(StoppedError, match=r"p\.1.*smoke") as caught:
            session.context.ask(PROMPT)
        assert session.events == []
    assert caught.value.exit_code == 5


def test_a_question_that_nobody_answers_is_not_journalled(tmp_path: Path) -> None:
    with running(tmp_path, operator=Scripted(otherwise=None)) as session:
        with pytest.raises(AnswerNeededError, match=r"p\.1"):
            session.context.ask(PROMPT)
        assert session.events == []


def test_no_beam_is_switched_on_before_safety_is_confirmed(tmp_path: Path) -> None:
    with running(tmp_path) as session:
        with pytest.raises(RuntimeError):
            capture(session, "p.2/500mm/L1/00")
        assert session.events == []
        session.context.confirm_safety()
        session.context.confirm_safety()
        assert session.kinds == ["answered"], "asked once in a session"
        session.context.bench.target.place(PLACEMENT)
        capture(session, "p.2/500mm/L1/00")
        assert session.kinds == ["answered", "capture_taken", "spots_found"]


def test_a_capture_is_on_disk_and_belongs_to_its_purpose(tmp_path: Path) -> None:
    with running(tmp_path) as session:
        context = session.context
        context.confirm_safety()
        context.bench.target.place(PLACEMENT)
        capture(session, "p.2/500mm/L1/00")
        capture(session, "p.2/500mm/all", scene="p.2/500mm")
        taken = [event for event in session.events if isinstance(event, CaptureTaken)]
        assert [(event.purpose, event.scene) for event in taken] == [
            ("calibration", None),
            ("trial", "p.2/500mm"),
        ]
        assert context.captures == taken
        for event in taken:
            assert event.off is not None
            for frame in (event.on, event.off):
                path = context.session_dir / frame.path
                assert hashlib.sha256(path.read_bytes()).hexdigest() == frame.sha256
            lit = read_image(context.session_dir / event.on.path)
            dark = read_image(context.session_dir / event.off.path)
            assert int(lit.max()) > int(dark.max()) + 50


def test_a_stop_that_was_asked_for_comes_before_the_next_capture(tmp_path: Path) -> None:
    with running(tmp_path) as session:
        session.context.confirm_safety()
        session.stop.append("enough")
        with pytest.raises(StoppedError, match="enough"):
            capture(session, "p.2/500mm/L1/00")
        with pytest.raises(StoppedError, match="enough"):
            session.context.warm_up("p.3", 1)
        assert "capture_taken" not in session.kinds


def test_what_was_captured_at_a_placement_is_forgotten_whole(tmp_path: Path) -> None:
    other = flat_placement("p.2", 800.0)
    with running(tmp_path) as session:
        context = session.context
        context.confirm_safety()
        lines = [prior_scanline(context.rig, context.rig.lasers[0])]
        for placement in (PLACEMENT, other):
            context.bench.target.place(placement)
            context.capture(f"{placement.key}/L1/00", ["L1"], placement, 0, lines)
        context.forget(PLACEMENT.key)
        assert [taken.placement_key for taken in context.captures] == [other.key]
        assert list(context.findings) == [f"{other.key}/L1/00"]


def test_the_measured_latency_is_journalled_and_discarded(tmp_path: Path) -> None:
    rig = with_emulator(two_laser_rig(), camera={"latency_frames": 2})
    with running(tmp_path, rig) as session:
        camera = session.context.bench.camera
        assert isinstance(camera, StreamingCamera)
        camera.discard_frames = 0
        session.context.bench.target.place(PLACEMENT)
        assert session.context.measure_latency("p.1", 5).frames == 2
        assert session.events[-1] == LatencyMeasured(frames=2)
        assert camera.discard_frames == 2


def test_a_camera_that_is_no_stream_has_no_latency(tmp_path: Path) -> None:
    class Still:
        def grab(self) -> Frame:
            raise AssertionError("no frame is asked for")

        grab_ambient = grab

        def close(self) -> None:
            pass

    with running(tmp_path) as session:
        session.context.bench = replace(session.context.bench, camera=Still())
        with pytest.raises(RigNotReadyError) as caught:
            session.context.measure_latency("p.1", 5)
        assert session.events == []
    assert caught.value.exit_code == 4
