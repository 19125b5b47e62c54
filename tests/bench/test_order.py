"""What comes before what: lasers off before every question, frames before their record; and a plan."""

from __future__ import annotations

import itertools
import os
import re
from pathlib import Path

import pytest

from tests.bench.test_guided_session import GRID, HEAD, Says, events, session
from tests.crash.short import write_files
from workbench.cli.plan import print_plan
from workbench.devices.guarded_lasers import GuardedLaserBank
from workbench.model import event as ev
from workbench.model.prompt import Answer, Prompt
from workbench.session.journal import Journal, read_journal


def test_lasers_are_put_off_before_every_question(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Verified off, since the last question: whatever was lit in between, the operator may step in."""
    printed: list[str] = []
    put_off = GuardedLaserBank.all_off

    def all_off(bank: GuardedLaserBank) -> None:
        put_off(bank)
        printed.append("off")

    class Operator(Says):
        def ask(self, prompt: Prompt) -> Answer:
            printed.append(f"ask {prompt.key}")
            return super().ask(prompt)

    monkeypatch.setattr(GuardedLaserBank, "all_off", all_off)
    question = "  - {step: ask, text: Which card?, choices: [white, grey]}\n"
    session(tmp_path, GRID + question, Operator(("p.2", Answer(value="grey"))))
    asked = [n for n, what in enumerate(printed) if what != "off"]
    assert len(asked) == 5, printed
    assert all(printed[n - 1] == "off" for n in asked)
    assert printed[-1] == "off", "and at the end"


def test_frames_are_on_disk_before_the_record_that_names_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Written under another name, synced, renamed, its folder synced; then one write for the record."""
    calls: list[tuple[str, str]] = []
    sync, write, replace, append = os.fsync, os.write, Path.replace, Journal.append

    def name_of(handle: int) -> str:
        return Path(f"/proc/self/fd/{handle}").readlink().name

    def fsync(handle: int) -> None:
        calls.append(("sync", name_of(handle)))
        sync(handle)

    def written(handle: int, data: bytes) -> int:
        if name_of(handle) == "journal.jsonl":
            calls.append(("record", "whole" if data.count(b"\n") == 1 and data.endswith(b"\n") else "part"))
        return write(handle, data)

    def replaced(path: Path, target: Path) -> Path:
        calls.append(("rename", Path(target).name))
        return replace(path, target)

    def appended(journal: Journal, event: ev.Event) -> ev.Record:
        calls.append(("append", event.kind))
        return append(journal, event)

    monkeypatch.setattr(os, "fsync", fsync)
    monkeypatch.setattr(os, "write", written)
    monkeypatch.setattr(Path, "replace", replaced)
    monkeypatch.setattr(Journal, "append", appended)
    done = session(tmp_path, GRID, Says())
    at = [n for n, call in enumerate(calls) if call == ("append", "capture_taken")]
    assert len(at) == 3 * 2 * 2
    for begin, end in itertools.pairwise([-1, *at]):
        # Two frames, written side by side: each synced under a temporary name, renamed, its folder synced.
        steps = [call for call in calls[begin + 1 : end] if call[1] != "journal.jsonl"]
        renamed = [(n, of) for n, (what, of) in enumerate(steps) if what == "rename" and of.endswith(".png")]
        assert len(renamed) == 2
        for n, name in renamed:
            assert any(what == "sync" and of.startswith(f".{name}.") for what, of in steps[:n])
            assert any(what == "sync" and not of.startswith(".") for what, of in steps[n + 1 :])
        assert calls[end + 1 : end + 3] == [("record", "whole"), ("sync", "journal.jsonl")]
    appends = [n for n, (what, _) in enumerate(calls) if what == "append"]
    assert len(appends) == len(list(read_journal(done)))
    assert all(calls[n + 1] == ("record", "whole") for n in appends), "one write a record"
    for kind in ("answered", "step_finished", "session_finished"):
        where = [n for n in appends if calls[n][1] == kind]
        assert where
        assert all(calls[n + 2] == ("sync", "journal.jsonl") for n in where)


def test_a_warm_up_runs_the_camera_in_the_dark(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its frames are taken, nothing is lit or kept, nobody is asked."""
    lit: list[object] = []
    monkeypatch.setattr(GuardedLaserBank, "lit", lambda *printed, **for_s: lit.append(printed))
    operator = Says()
    grabbed: list[str] = []
    monkeypatch.setattr(
        "workbench.emulator.camera.EmulatedCamera.grab", lambda camera: grabbed.append(camera._key)
    )
    done = session(tmp_path, "  - {step: warm_up, frames: 7}\n", operator)
    assert grabbed == ["p.1"] * 7
    assert lit == operator.asked == []
    assert not list((done / "frames").rglob("*.png"))
    (ended,) = [e for e in events(done, ev.StepFinished) if isinstance(e, ev.StepFinished)]
    assert ended.outcome == "7 frames"


def test_a_plan_prints_every_step_with_captures_emission_and_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    steps = "  - {step: warm_up, frames: 100}\n" + GRID + "  - step: fit\n"
    rig, procedure = write_files(tmp_path, HEAD + steps)
    print_plan([procedure], rig, tmp_path / "sessions")
    printed = capsys.readouterr().out
    assert max(map(len, printed.splitlines())) <= 80
    step_rows = [re.split(r"\s{2,}", line) for line in printed.splitlines() if line.startswith("p.")]
    # Three placings of 64 s, 12 captures of a second, 2 s of lease each.
    assert [row[0] for row in step_rows] == ["p.1", "p.2", "p.3"]
    assert [row[2:] for row in step_rows] == [
        ["-", "-", "-", "10 s"],
        ["3", "12", "24.0", "3 min"],
        ["-", "-", "-", "10 s"],
    ]
    assert "12 captures, at most 24 s of emission (leases of 2 s); 4 min" in printed
    assert "no session of" in " ".join(printed.split())
    session(tmp_path, steps.replace("  - step: fit\n", ""), Says())
    print_plan([procedure], rig, tmp_path)
    printed = " ".join(capsys.readouterr().out.split())
    assert "the last session of" in printed
    assert "at most" not in printed.partition("trial exposures")[0].partition("If ")[0], (
        "emission as it was measured"
    )
