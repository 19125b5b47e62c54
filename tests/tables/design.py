"""Output of `workbench design` for the documentation: `python -m tests.tables.design`; half a minute."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

from tests.support.stored_output import ROOT, store
from workbench.api.simulation import STANDOFFS_MM
from workbench.calibration.design import standoffs
from workbench.calibration.design.forecast import CalibrationForecast, forecast
from workbench.model.rig import load_rig

COUNTS = (3, 5, 7, 11, 15)
REPEATS = 10
NEAR_MM = 150.0


def comparison() -> Iterator[str]:
    """Rows: design; worst relative sd, that of the calibration alone, that of laser 1 at 150 mm, all in %."""
    rig = load_rig(ROOT / "rigs/thesis-emulated.yaml")
    proposed = {n: forecast(rig, standoffs.best_standoffs(rig, n, REPEATS), REPEATS) for n in COUNTS}
    with mock.patch.object(standoffs, "SPARED", 0.0):
        worst_alone = standoffs.best_standoffs(rig, 11, REPEATS)
    yield _row("calibrate-flat.yaml, 11", forecast(rig, STANDOFFS_MM, REPEATS))
    for count, found in proposed.items():
        yield _row(f"proposed, {count}", found)
    yield _row("by the worst range alone, 11", forecast(rig, worst_alone, REPEATS))


def _row(name: str, found: CalibrationForecast) -> str:
    near = next(one for one in found.ranges if one.laser_id == "L1" and one.range_mm == NEAR_MM)
    assert near.relative_sd is not None
    figures = (found.worst_relative_sd, found.worst_relative_sd_of_calibration, near.relative_sd)
    return f"{name:30}" + "".join(f"{100 * figure:8.2f}" for figure in figures)


def main() -> None:
    """Run, print, write."""
    workbench = Path(sys.executable).with_name("workbench")
    done = subprocess.run(
        [workbench, "design", "--rig", "rigs/thesis-emulated.yaml"],
        cwd=ROOT,
        env=os.environ | {"COLUMNS": "80"},
        capture_output=True,
        text=True,
        check=True,
    )
    lines = [
        *done.stdout.rstrip().splitlines(),
        "",
        f"{'standoffs':30}{'worst %':>8}{'alone %':>8}{f'L1 {NEAR_MM:g}':>8}",
        *comparison(),
    ]
    store("design", "Design of standoffs", "python -m tests.tables.design", lines)


if __name__ == "__main__":
    main()
