"""`make prove`: print the table, keep it in docs/benchmarks, fail where a figure is missed."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tests.proofs import report, shape_scores, study
from tests.proofs.solve import Solve, at_once, one_by_one
from tests.support.stored_output import store
from workbench.model.prior import Prior
from workbench.model.rig import Rig, load_rig
from workbench.procedure.engine.procedure_file import load_procedure
from workbench.steps.capture_grid import CaptureGridStep

ROOT = Path(__file__).parents[2]
BLOCK = 1000
SEED = 2001
READINGS = 4000
"""Simulated readings for each figure of the shapes."""
K3_SD = 0.1


def main() -> int:
    """Run, print, write; 1 if a figure is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--thousands", type=int, default=10, help="how many times 1000 calibrations at once")
    parser.add_argument("--chosen", type=int, default=2, help="how many times 1000 one by one")
    asked = parser.parse_args()
    rig = load_rig(ROOT / "rigs/thesis-emulated.yaml")
    whole = study.joined(list(_blocks(rig, asked.thousands, at_once)))
    lines, misses = report.tables(rig, whole, "fitted by calibration.estimation.batch, the whole model")
    if asked.chosen:
        wider = _with_k3(rig)
        chosen = study.joined(list(_blocks(wider, asked.chosen, one_by_one)))
        more, missed = report.tables(
            wider, chosen, f"fitted as by `workbench fit`, terms chosen; k3 +- {K3_SD}"
        )
        lines, misses = [*lines, "", *more], misses + missed
    shapes, missed = shape_scores.scores(READINGS, SEED)
    lines, misses = [*lines, "", "Shapes, lasers of the thesis, calibration exact", *shapes], misses + missed
    command = f"python -m tests.proofs --thousands {asked.thousands} --chosen {asked.chosen}"
    store("proofs", "Proofs", command, [f"seed {SEED}", *lines])
    return 1 if misses else 0


def _with_k3(rig: Rig) -> Rig:
    """A lens that may have a sixth order as well: something to leave out where it buys nothing."""
    k3 = rig.camera.model_copy(update={"k3": Prior(value=0.0, sd=K3_SD)})
    return rig.model_copy(update={"camera": k3})


def _blocks(rig: Rig, blocks: int, solve: Solve) -> Iterator[study.Outcome]:
    """Calibrations by the grid of calibrate-flat.yaml, a thousand at a time."""
    procedure = load_procedure(ROOT / "procedures/calibrate-flat.yaml")
    grid = next(step for step in procedure.steps if isinstance(step, CaptureGridStep))
    for block in range(blocks):
        rng = np.random.default_rng([SEED, block])
        yield study.run(rig, np.array(grid.standoffs_mm), grid.repeats, BLOCK, rng, solve)
        print(f"{BLOCK * (block + 1)} calibrations", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
