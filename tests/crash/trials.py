"""Trials that are killed at every record: `python -m tests.crash.trials`, or a short one in a test.

Each session is killed while it writes a record, and resumed. Every file of the resumed session must be
bit-identical with that of a session without a kill.
"""

from __future__ import annotations

import signal
import sys
import tempfile
from pathlib import Path

from tests.bench.sensors import calibration_of
from tests.crash.killer import Killer, serving
from tests.crash.short import ROOT, begin, go_on, results, story
from workbench.calibration.verdict.export import render
from workbench.model.rig import load_rig
from workbench.session.journal import read_journal

NAME = "s"
RIG = ROOT / "rigs/thesis-emulated.yaml"
EXPOSURE_S = 4e-5
TRIALS = {
    "missing_spots_trial": "ranges_mm: [400], missing: [1], blocked: [1], readings: 1",
    "accuracy_trial": "standoffs_mm: [300, 500], readings: 2",
    "repeatability_trial": "standoffs_mm: [400], placements: 2, repeats: 2, dither_mm: 2",
    "gauge_rr_trial": "standoffs_mm: [300, 500], operators: [A, B], trials: 2",
    "incline_trial": "ranges_mm: [300], targets: [{kind: incline, angle_deg: 30}], readings: 2",
    "round_trial": "ranges_mm: [250], target: {kind: cylinder, diameter_mm: 178}, readings: 2",
    "verify_trial": "standoffs_mm: [300, 700], readings: 1",
    "drive": f"world: {ROOT}/procedures/worlds/office.yaml, stop_mm: 200, step_mm: 50,"
    " drives: [{name: leg, start: {x_mm: 2500, y_mm: 1030}, distance_mm: 100},"
    " {name: aside, start: {x_mm: 2500, y_mm: 600}, distance_mm: 50}]",
}
"""Keys of the step of each trial, by its kind."""


def write_trial(folder: Path, trial: str) -> None:
    """Rig, calibration and procedure of a trial."""
    # Without a search for the exposure, whose result depends on deadlines that a busy machine may miss.
    (folder / "rig.yaml").write_text(RIG.read_text() + f"  camera: {{exposure_s: {EXPOSURE_S}}}\n")
    (folder / "c.yaml").write_text(render(calibration_of(load_rig(RIG))))
    head = f"format: 1\nprocedure: short\ntitle: Short\nsteps:\n  - step: {trial}\n"
    (folder / "p.yaml").write_text(head + "".join(f"    {line}\n" for line in _lines(TRIALS[trial])))


def undisturbed(folder: Path, trial: str) -> Path:
    """Session without a kill; all sessions have its name, which their journals contain."""
    write_trial(folder, trial)
    begin(folder, folder / NAME)
    return folder / NAME


def differs(killer: Killer, whole: Path, folder: Path, record: int) -> str:
    """Difference of a session in a folder that is killed at a record and resumed; empty if there is none."""
    folder.mkdir(exist_ok=True)
    session = folder / NAME
    if killer.run(session, "torn", record) != signal.SIGKILL:
        return "it was not killed"
    go_on(session)
    if results(session) != results(whole):
        ours, theirs = results(session), results(whole)
        return f"files: {sorted(name for name in {*ours, *theirs} if ours.get(name) != theirs.get(name))}"
    return "" if story(session) == story(whole) else "events"


def main() -> int:
    """Kill every trial at every record; 1 if a result differs."""
    wrong = 0
    for trial in TRIALS:
        with tempfile.TemporaryDirectory() as name:
            whole = undisturbed(Path(name), trial)
            records = len(list(read_journal(whole)))
            with serving(Path(name)) as killer:
                found = [differs(killer, whole, Path(name) / str(n), n) for n in range(records)]
        failed = [(n, text) for n, text in enumerate(found) if text]
        wrong += len(failed)
        print(f"{trial}: {records} records, {len(failed)} differences {failed}", flush=True)
    return 1 if wrong else 0


def _lines(keys: str) -> list[str]:
    """Keys of a step in flow style, one a line: commas inside brackets separate no keys."""
    lines, depth = [""], 0
    for character in keys:
        depth += character in "[{"
        depth -= character in "]}"
        if character == "," and depth == 0:
            lines.append("")
        else:
            lines[-1] += character
    return [line.strip() for line in lines]


if __name__ == "__main__":
    sys.exit(main())
