"""Running procedures: the session's records, and how each end is journalled."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.procedures import CALLER, plan_of, story
from workbench.model import event as ev
from workbench.model.errors import BadInputError, StoppedError
from workbench.procedure.engine.run import Invocation, run
from workbench.session.manifest import load_manifest

STEPS = "  - {step: message, text: Hello.}\n  - {step: place_target, standoff_mm: 500}\n"


def test_a_session_is_journalled_from_start_to_end(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, a=STEPS, b="  - {step: message, text: Bye.}\n")
    shown: list[ev.Record] = []
    run(plan, tmp_path / "s", [shown.append], CALLER, lambda: None)
    events = story(tmp_path / "s")
    assert [record.event for record in shown] == events
    started = [(e.procedure, e.index, e.step) for e in events if isinstance(e, ev.StepStarted)]
    assert started == [("a", 1, "message"), ("a", 2, "place_target"), ("b", 1, "message")]
    assert events[0] == ev.SessionStarted(session="s", rig=plan.rig.rig, procedures=("a", "b"))
    assert events[-1] == ev.SessionFinished(exit_code=0, message="done")
    manifest = load_manifest(tmp_path / "s")
    assert Invocation(manifest.operator, manifest.command, manifest.created) == CALLER


def test_a_failure_is_journalled_with_its_exit_code_before_it_goes_on(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, a=STEPS)
    with pytest.raises(StoppedError):
        run(plan, tmp_path / "s", [], CALLER, lambda: "enough")
    assert story(tmp_path / "s")[-1] == ev.SessionFinished(exit_code=5, message="enough")


def test_a_defect_is_journalled_with_exit_code_1(tmp_path: Path) -> None:
    def defect(record: ev.Record) -> None:
        if isinstance(record.event, ev.StepStarted):
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        run(plan_of(tmp_path, a=STEPS), tmp_path / "s", [defect], CALLER, lambda: None)
    (last,) = [e for e in story(tmp_path / "s") if isinstance(e, ev.SessionFinished)]
    assert last.exit_code == 1


def test_a_session_is_not_run_into_a_folder_that_exists(tmp_path: Path) -> None:
    (tmp_path / "s").mkdir()
    with pytest.raises(BadInputError, match=str(tmp_path / "s")) as caught:
        run(plan_of(tmp_path, a=STEPS), tmp_path / "s", [], CALLER, lambda: None)
    assert caught.value.exit_code == 2
    assert list((tmp_path / "s").iterdir()) == []


def test_a_folder_of_sessions_that_cannot_be_made_is_bad_input(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(BadInputError, match=str(tmp_path / "file")):
        run(plan_of(tmp_path, a=STEPS), tmp_path / "file/s", [], CALLER, lambda: None)
