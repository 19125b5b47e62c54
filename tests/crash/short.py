"""A short procedure on a small rig: what the crash suite kills, over and over."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from workbench.model import event as ev
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.resume import resume
from workbench.procedure.engine.run import Invocation, run
from workbench.session.journal import read_journal
from workbench.session.state import effective

ROOT = Path(__file__).parents[2]
CALLER = Invocation(operator="A. Technician", command="workbench run", created="2026-01-01T12:00:00+0000")
RESUMER = Invocation(operator="B. Other", command="workbench resume", created="2026-01-02T12:00:00+0000")
PROCEDURE = """\
format: 1
procedure: short
title: Short
steps:
  - step: message
    text: Begin.
  - step: capture_grid
    standoffs_mm: [300, 600, 1500]
    repeats: 1
  - step: fit
    limits: {max_relative_range_sd: 0.5}
  - step: export
  - step: accuracy_trial
    standoffs_mm: [800]
    readings: 1
"""
CALIBRATION = PROCEDURE.replace("  - step: message\n    text: Begin.\n", "").partition(
    "  - step: accuracy_trial"
)[0]
"""The same without a message and a trial."""
GROUP = 2
"""Captures at one placement: the rig has two lasers."""


def write_files(folder: Path, procedure: str = PROCEDURE) -> tuple[Path, Path]:
    """Rig file of the emulated rig's outer lasers, and the procedure's."""
    rig = (ROOT / "rigs/thesis-emulated.yaml").read_text()
    rig = re.sub(r"  - id: L[23]\n(    .*\n)+", "", rig)
    (folder / "rig.yaml").write_text(rig)
    (folder / "p.yaml").write_text(procedure)
    return folder / "rig.yaml", folder / "p.yaml"


def with_small_pictures(rig: Path) -> None:
    """Give the rig file a camera of a quarter of the pixels, each of twice the side, for faster frames."""
    text = rig.read_text()
    for old, new in (
        ("width_px: 640", "width_px: 320"),
        ("height_px: 480", "height_px: 240"),
        ("f_px: {value: 533.3, sd: 26.7}", "f_px: {value: 266.65, sd: 13.35}"),
        ("cx_px: {value: 319.5, sd: 40.0}", "cx_px: {value: 159.5, sd: 20.0}"),
        ("cy_px: {value: 239.5, sd: 40.0}", "cy_px: {value: 119.5, sd: 20.0}"),
        ("seed: 2001", "seed: 2001\n  sensor: {pitch_um: 15.0}"),
    ):
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    rig.write_text(text)


def begin(files: Path, session: Path, consumers: Sequence[ev.Consumer] = ()) -> None:
    """Run it in a new session, with the calibration in the folder if there is one."""
    calibration = files / "c.yaml"
    plan = Plan.load(files / "rig.yaml", [files / "p.yaml"], calibration if calibration.exists() else None)
    run(plan, session, consumers, CALLER, lambda: None)


def go_on(session: Path, consumers: Sequence[ev.Consumer] = ()) -> None:
    """Resume it, as somebody else on another day."""
    resume(session, consumers, RESUMER, lambda: None)


def story(session: Path) -> list[ev.Event]:
    """What counts of a session, without its clock readings and without what a resumption adds."""
    events = [record.event for record in effective(read_journal(session))]
    return [_timeless(e) for e in events if not isinstance(e, ev.SessionResumed) and not _is_safety(e)]


def _is_safety(event: ev.Event) -> bool:
    """Whoever resumes is asked again."""
    return isinstance(event, ev.Answered) and event.key == "safety"


def _timeless(event: ev.Event) -> ev.Event:
    if not isinstance(event, ev.CaptureTaken):
        return event
    frames = {"on": event.on.model_copy(update={"time_ns": 0})}
    if event.off is not None:
        frames["off"] = event.off.model_copy(update={"time_ns": 0})
    return event.model_copy(update=frames | {"lit_s": None})


def results(session: Path) -> dict[str, bytes]:
    """Every file that a session ends with, but for its journal, manifest and what was set aside."""
    return {
        str(path.relative_to(session)): path.read_bytes()
        for path in sorted(session.rglob("*"))
        if path.is_file()
        and path.name not in {"journal.jsonl", "session.yaml", "recording.rrd"}
        and "set-aside" not in path.parts
    }
