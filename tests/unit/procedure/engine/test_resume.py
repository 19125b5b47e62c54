"""Going on with a session that ended early."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from tests.support.procedures import CALLER, RIG, plan_of, story
from workbench.model import event as ev
from workbench.model.errors import BadInputError, StoppedError
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.resume import files_now, first_change, resume
from workbench.procedure.engine.resume import plan_of as plan_of_manifest
from workbench.procedure.engine.run import Invocation, run
from workbench.session.journal import read_journal
from workbench.session.manifest import load_manifest

STEPS = (
    "  - {step: message, text: Hello.}\n"
    "  - {step: place_target, standoff_mm: 500}\n"
    "  - {step: place_target, standoff_mm: 700}\n"
)
RESUMER = Invocation(operator="B. Other", command="workbench resume", created="2026-01-02T12:00:00+0000")


def after_placements(count: int) -> tuple[Callable[[], str | None], Callable[[ev.Record], None]]:
    """Asks for a stop once `count` placements are finished, and counts them."""
    finished: list[ev.Record] = []

    def see(record: ev.Record) -> None:
        if isinstance(record.event, ev.PlacementFinished):
            finished.append(record)

    return lambda: "enough" if len(finished) >= count else None, see


@pytest.fixture
def stopped(tmp_path: Path) -> Path:
    """A session that was stopped after the first of two placements."""
    rig = tmp_path / "rig.yaml"
    rig.write_text(RIG.read_text())
    plan = plan_of(tmp_path, rig, a=STEPS)
    stopping, see = after_placements(1)
    with pytest.raises(StoppedError):
        run(plan, tmp_path / "s", [see], CALLER, stopping)
    return tmp_path / "s"


def placed(events: list[ev.Event]) -> list[str]:
    return [event.placement.key for event in events if isinstance(event, ev.TargetPlaced)]


def test_it_goes_on_where_the_session_stopped(stopped: Path) -> None:
    before = story(stopped)
    resume(stopped, [], RESUMER, lambda: None)
    after = story(stopped)
    assert after[: len(before)] == before
    assert placed(before) == ["a.2/500mm"]
    assert placed(after) == ["a.2/500mm", "a.3/700mm"], "the whole placement is not placed again"
    (resumed,) = [event for event in after if isinstance(event, ev.SessionResumed)]
    assert (resumed.operator, resumed.created, resumed.changes) == (RESUMER.operator, RESUMER.created, ())
    assert after[-1] == ev.SessionFinished(exit_code=0, message="done")


def test_a_finished_session_is_not_resumed(stopped: Path) -> None:
    resume(stopped, [], RESUMER, lambda: None)
    before = story(stopped)
    with pytest.raises(BadInputError, match=str(stopped)) as caught:
        resume(stopped, [], RESUMER, lambda: None)
    assert caught.value.exit_code == 2
    assert story(stopped) == before


def test_a_folder_without_a_session_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"session\.yaml"):
        resume(tmp_path, [], RESUMER, lambda: None)


def test_a_session_is_resumed_under_its_own_name(stopped: Path) -> None:
    other = stopped.rename(stopped.with_name("other"))
    with pytest.raises(BadInputError, match=r"other.* s,"):
        resume(other, [], RESUMER, lambda: None)


def test_a_procedure_that_changed_needs_a_reason(stopped: Path) -> None:
    procedure = stopped.parent / "a.yaml"
    procedure.write_text(procedure.read_text().replace("standoff_mm: 700", "standoff_mm: 800"))
    before = story(stopped)
    with pytest.raises(BadInputError, match=str(procedure)):
        resume(stopped, [], RESUMER, lambda: None)
    assert story(stopped) == before
    resume(stopped, [], RESUMER, lambda: None, accepted_because="no room at 700")
    (resumed,) = [event for event in story(stopped) if isinstance(event, ev.SessionResumed)]
    assert resumed.accepted_because == "no room at 700"
    assert len(resumed.changes) == 1
    assert placed(story(stopped))[-1] == "a.3/800mm"
    assert "800" in load_manifest(stopped).procedures[0].text
    assert "700" in (stopped / "session-1.yaml").read_text(), "the manifest up to now is kept"


def test_a_kill_between_acceptance_and_manifest_asks_for_the_reason_again(
    stopped: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (stopped.parent / "a.yaml").write_text((stopped.parent / "a.yaml").read_text().replace("700", "800"))
    manifest = (stopped / "session.yaml").read_bytes()

    class KilledError(BaseException):
        pass

    def killed(*_: object) -> None:
        raise KilledError

    monkeypatch.setattr("workbench.procedure.engine.resume.replace_manifest", killed)
    with pytest.raises(KilledError):
        resume(stopped, [], RESUMER, lambda: None, accepted_because="first")
    monkeypatch.undo()
    assert (stopped / "session.yaml").read_bytes() == manifest
    with pytest.raises(BadInputError, match="changed"):
        resume(stopped, [], RESUMER, lambda: None)
    resume(stopped, [], RESUMER, lambda: None, accepted_because="second")
    resumed = [r.event for r in read_journal(stopped) if isinstance(r.event, ev.SessionResumed)]
    assert [event.accepted_because for event in resumed] == ["first", "second"]
    assert placed(story(stopped))[-1] == "a.3/800mm"


def test_a_manifest_is_replaced_only_after_the_acceptance_is_journalled(
    stopped: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (stopped.parent / "a.yaml").write_text((stopped.parent / "a.yaml").read_text().replace("700", "800"))
    journalled: list[str | None] = []

    def replaced(folder: Path, *_: object) -> None:
        last = list(read_journal(folder))[-1].event
        assert isinstance(last, ev.SessionResumed)
        journalled.append(last.accepted_because)

    monkeypatch.setattr("workbench.procedure.engine.resume.replace_manifest", replaced)
    resume(stopped, [], RESUMER, lambda: None, accepted_because="shorter")
    assert journalled == ["shorter"]


def test_a_comment_or_a_file_that_is_gone_is_no_change(stopped: Path) -> None:
    procedure, rig = stopped.parent / "a.yaml", stopped.parent / "rig.yaml"
    rig.write_text("# moved to the other room\n" + rig.read_text())
    procedure.unlink()
    now, changes = files_now(stopped, load_manifest(stopped))
    assert changes == ()
    plan = plan_of_manifest(stopped, now)
    assert isinstance(plan, Plan)
    assert [len(one.steps) for one in plan.procedures] == [3]


def test_another_version_is_a_change_that_names_it(stopped: Path) -> None:
    manifest = load_manifest(stopped)
    older = manifest.model_copy(update={"versions": manifest.versions | {"numpy": "0.9"}})
    _, changes = files_now(stopped, older)
    assert len(changes) == 1
    assert {"numpy:", "0.9"} <= set(changes[0].split())


@pytest.mark.parametrize(
    ("before", "now", "where"),
    [
        ({"a": 1, "b": {"c": [1, {"d": 2}]}}, {"a": 1, "b": {"c": [1, {"d": 3}]}}, "b.c[1].d (2, now 3)"),
        ({"a": [1, 2]}, {"a": [1, 2, 3]}, "a ([1, 2], now [1, 2, 3])"),
        ({"a": 1, "b": 2}, {"a": 3, "b": 4}, "a (1, now 3)"),
        ({"a": {"b": None}}, {"a": {"b": 5}}, "a.b (nothing, now 5)"),
    ],
)
def test_a_change_is_named_by_its_first_key(before: object, now: object, where: str) -> None:
    assert first_change(before, now) == where


def test_a_changed_rig_file_is_named_with_the_key_that_changed(stopped: Path) -> None:
    rig = stopped.parent / "rig.yaml"
    values = yaml.safe_load(rig.read_text())
    values["bench"]["placement_sd_mm"] = 7.5
    rig.write_text(yaml.safe_dump(values))
    _, changes = files_now(stopped, load_manifest(stopped))
    assert len(changes) == 1
    assert "bench.placement_sd_mm" in changes[0]
    assert "7.5" in changes[0]
