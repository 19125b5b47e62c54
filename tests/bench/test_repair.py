"""Repairs of ended sessions on the virtual bench: a spoilt placement, one left out, restored, added."""

from __future__ import annotations

import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tests.crash.short import RESUMER, begin, go_on, results, with_small_pictures, write_files
from workbench.model import event as ev
from workbench.model.calibration import Calibration, load_calibration
from workbench.model.captures import load_captures
from workbench.model.errors import BadInputError, LimitFailedError, StoppedError
from workbench.procedure.engine.repair import Repair, find_placement
from workbench.procedure.engine.resume import resume
from workbench.session.journal import read_journal
from workbench.session.state import effective

PROCEDURE = """\
format: 1
procedure: short
title: Short
steps:
  - step: capture_grid
    standoffs_mm: [200, 300, 450, 700, 1100, 1500]
    repeats: 2
  - step: fit
    limits: {max_relative_range_sd: 0.5}
  - step: export
"""
SPOILT = "short.1/300mm"
SCRIPT = Path(sys.executable).with_name("workbench")


def session(folder: Path, spoilt: bool) -> Path:
    """Folder of a session, with a placement 20 mm off if it is spoilt; it then ends refused."""
    rig, _ = write_files(folder, PROCEDURE)
    with_small_pictures(rig)
    if spoilt:
        rig.write_text(
            f"{rig.read_text().rstrip()}\n  truth: {{placements: {{{SPOILT}: {{error_mm: 20}}}}}}\n"
        )
        with pytest.raises(LimitFailedError):
            begin(folder, folder / "s")
    else:
        begin(folder, folder / "s")
    return folder / "s"


@pytest.fixture(scope="module")
def refused(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return session(tmp_path_factory.mktemp("refused"), spoilt=True)


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return session(tmp_path_factory.mktemp("good"), spoilt=False)


@pytest.fixture
def copy(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """Copy of the session named by the parameter."""
    source: Path = request.getfixturevalue(request.param)
    shutil.copytree(source.parent, tmp_path / "f")
    return tmp_path / "f" / "s"


def repair(folder: Path, stop_after: int | None = None, **decisions: Any) -> list[ev.Event]:
    """Repair a session and return its valid events; `stop_after` captures it is stopped."""
    taken: list[ev.Record] = []

    def stopping() -> str | None:
        return "enough" if stop_after is not None and len(taken) >= stop_after else None

    def count(record: ev.Record) -> None:
        if isinstance(record.event, ev.CaptureTaken) and record.n > before:
            taken.append(record)

    before = list(read_journal(folder))[-1].n
    resume(folder, [count], RESUMER, stopping, repair=Repair("because", **decisions))
    return [record.event for record in effective(read_journal(folder))]


def standoffs(folder: Path) -> list[float]:
    return sorted(pd.read_csv(folder / "captures.csv")["standoff_mm"].unique().tolist())


def calibration(folder: Path) -> Calibration:
    return load_calibration(folder / "calibration.yaml")


@pytest.mark.parametrize("copy", ["refused"], indirect=True)
def test_a_spoilt_placement_is_captured_again_and_nothing_else(copy: Path) -> None:
    before = {path.name: path.read_bytes() for path in copy.rglob("*.png") if "300mm" not in str(path)}
    old = sorted(path.read_bytes() for path in copy.rglob("*.png") if "300mm" in str(path))
    events = repair(copy, recapture=("300",))
    assert isinstance(events[-1], ev.SessionFinished)
    assert events[-1].exit_code == 0
    assert calibration(copy).laser_ranger.fit.verdict == "accepted"
    taken = [e for e in events if isinstance(e, ev.CaptureTaken)]
    assert len(taken) == 6 * 2 * 2
    assert {
        path.name: path.read_bytes() for path in copy.rglob("*.png") if "300mm" not in str(path)
    } == before
    order = pd.read_csv(copy / "captures.csv")["standoff_mm"].drop_duplicates().tolist()
    assert order == [200.0, 450.0, 700.0, 1100.0, 1500.0, 300.0], "in the order of time, for a drift"
    kept = sorted(path.read_bytes() for path in (copy / "set-aside").rglob("*.png"))
    assert kept == old, "the captures that do not count are kept"


@pytest.mark.parametrize("copy", ["good"], indirect=True)
def test_captures_that_were_replaced_are_restored_and_exchanged_again(copy: Path) -> None:
    first = results(copy)
    repair(copy, recapture=("300",))
    second = results(copy)
    assert second["captures.csv"] != first["captures.csv"]
    repair(copy, restore=("300",))
    assert results(copy) == first
    repair(copy, restore=("300",))
    assert results(copy) == second


@pytest.mark.parametrize("copy", ["good"], indirect=True)
def test_captures_are_restored_after_a_recapture_that_was_stopped(copy: Path) -> None:
    first = results(copy)
    with pytest.raises(StoppedError):
        repair(copy, stop_after=2, recapture=("300",))
    repair(copy, restore=("300",))
    assert results(copy) == first


@pytest.mark.parametrize("copy", ["good"], indirect=True)
def test_captures_whose_frames_are_gone_are_not_restored(copy: Path) -> None:
    repair(copy, recapture=("300",))
    shutil.rmtree(copy / "set-aside")
    before = (copy / "journal.jsonl").read_bytes()
    with pytest.raises(BadInputError, match="300mm"):
        repair(copy, restore=("300",))
    assert (copy / "journal.jsonl").read_bytes() == before


@pytest.mark.thorough
def test_a_repair_of_a_drifting_bench_begins_another_part(tmp_path: Path) -> None:
    """Its drift begins again, as that of a sensor that has cooled."""
    rig, _ = write_files(tmp_path, PROCEDURE)
    with_small_pictures(rig)
    rig.write_text(f"{rig.read_text().rstrip()}\n  drift: {{u_px_per_frame: 0.001}}\n")
    begin(tmp_path, tmp_path / "s")
    repair(tmp_path / "s", recapture=("300",))
    rows = load_captures(tmp_path / "s/captures.csv")
    assert {row.standoff_mm for row in rows if row.part == "1"} == {300.0}
    first = [row.time_s for row in rows if not row.part]
    again = [row.time_s for row in rows if row.part]
    assert len(again) == 4
    assert max(first) < min(again)
    assert first == sorted(first)


@pytest.mark.parametrize("copy", ["refused"], indirect=True)
def test_a_repair_that_is_stopped_goes_on_and_gives_the_same(copy: Path) -> None:
    other = shutil.copytree(copy.parent, copy.parent.with_name("g")) / "s"
    repair(other, recapture=("300",))
    with pytest.raises(StoppedError):
        repair(copy, stop_after=2, recapture=("300",))
    go_on(copy)
    assert results(copy) == results(other)


@pytest.mark.parametrize("copy", ["refused"], indirect=True)
def test_a_placement_is_left_out_and_restored(copy: Path) -> None:
    events = repair(copy, leave_out=("300",))
    assert not any(isinstance(e, ev.CaptureTaken) and e.placement_key == SPOILT for e in events)
    assert 300.0 not in standoffs(copy)
    assert any("300" in warning for warning in calibration(copy).laser_ranger.fit.warnings)
    with pytest.raises(LimitFailedError):
        repair(copy, restore=("300",))
    assert 300.0 in standoffs(copy)


@pytest.mark.parametrize("copy", ["refused"], indirect=True)
def test_a_refused_calibration_is_accepted_with_a_reason(copy: Path) -> None:
    repair(copy, accept=True)
    fit = calibration(copy).laser_ranger.fit
    assert (fit.verdict, fit.accepted_because) == ("refused", "because")


@pytest.mark.parametrize("copy", ["good"], indirect=True)
def test_a_standoff_is_added_to_a_finished_session(copy: Path) -> None:
    before = calibration(copy)
    events = repair(copy, add_mm=(900.0, 700.0))
    placed = [e.placement.key for e in events if isinstance(e, ev.TargetPlaced)]
    assert placed[-2:] == ["short.1/900mm", "short.1/02-700mm"]
    assert len(standoffs(copy)) == 7
    sd = np.array([c.laser_ranger.parameters.sd for c in (before, calibration(copy))])
    assert (sd[1] <= 1.01 * sd[0]).all(), "but for the changed values at which they are computed"
    assert (sd[1] < sd[0]).any()


@pytest.mark.thorough
@pytest.mark.parametrize("copy", ["good"], indirect=True)
def test_the_prompt_of_an_added_placement_is_answered_from_a_file(copy: Path) -> None:
    answers = copy.parent / "answers.yaml"
    answers.write_text("short.1/900mm: 905\n")
    command: list[str | Path] = [SCRIPT, "repair", "s", "--add", "900", "--reason", "r", "--answers", answers]
    done = subprocess.run(command, cwd=copy.parent, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert 905.0 in standoffs(copy)


@pytest.mark.parametrize("copy", ["good"], indirect=True)
@pytest.mark.parametrize(
    "decisions",
    [
        {},
        {"recapture": ("310",)},
        {"recapture": ("300",), "leave_out": (SPOILT,)},
        {"restore": ("300",)},
    ],
)
def test_a_repair_that_cannot_be_leaves_the_session_as_it_was(copy: Path, decisions: dict[str, Any]) -> None:
    before = (copy / "journal.jsonl").read_bytes()
    with pytest.raises(BadInputError, match="repair"):
        repair(copy, **decisions)
    assert (copy / "journal.jsonl").read_bytes() == before


KEYS = ["p.1/280mm", "p.1/450mm", "p.1/2800mm", "p.1/02-2800mm", "q.1/280mm"]


@pytest.mark.parametrize(
    ("name", "key"),
    [
        ("2800mm", None),
        ("p.1/280mm", "p.1/280mm"),
        ("02-2800mm", "p.1/02-2800mm"),
        ("450.0", "p.1/450mm"),
        ("4.5e2 mm", "p.1/450mm"),
        ("280", None),
        ("28", None),
    ],
)
def test_a_placement_has_one_name(name: str, key: str | None) -> None:
    if key is not None:
        assert find_placement(name, KEYS) == key
    else:
        with pytest.raises(BadInputError):
            find_placement(name, KEYS)


@pytest.mark.parametrize("copy", ["refused"], indirect=True)
def test_the_command_that_a_refused_session_prints_repairs_it(copy: Path) -> None:
    def call(*arguments: str) -> tuple[int, list[str]]:
        done = subprocess.run(
            [SCRIPT, *arguments], cwd=copy.parent, capture_output=True, text=True, timeout=120
        )
        return done.returncode, done.stderr.splitlines()

    code, lines = call("resume", "s")
    assert code == 3
    command = next((line for line in lines if "--recapture" in line), "")
    assert SPOILT in command, lines
    _, _, arguments = command.partition(" workbench ")
    code, lines = call(*shlex.split(arguments))
    assert code == 0, lines
    assert calibration(copy).laser_ranger.fit.verdict == "accepted"
