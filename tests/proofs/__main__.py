"""`make prove`: print the table, keep it in docs/benchmarks, fail where a figure is missed."""

from __future__ import annotations

import argparse
import datetime as dt
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tests.proofs import report, study
from workbench.model.procedure import CaptureGridStep, load_procedure
from workbench.model.rig import Rig, load_rig

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "docs" / "benchmarks"
BLOCK = 1000
SEED = 2001


def main() -> int:
    """Run, print, write; 1 if a figure is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--thousands", type=int, default=10, help="how many times 1000 calibrations")
    blocks = parser.parse_args().thousands
    rig = load_rig(ROOT / "rigs/thesis-emulated.yaml")
    today = dt.datetime.now(tz=dt.UTC).date().isoformat()
    outcome = study.joined(list(_blocks(rig, blocks)))
    lines, misses = report.tables(rig, outcome)
    lines = [f"Proofs, {today}: `python -m tests.proofs --thousands {blocks}`, seed {SEED}", *lines]
    print("\n".join(lines))
    RESULTS.mkdir(parents=True, exist_ok=True)
    (RESULTS / f"{today}-proofs.txt").write_text("\n".join(lines) + "\n")
    return 1 if misses else 0


def _blocks(rig: Rig, blocks: int) -> Iterator[study.Outcome]:
    """Calibrations by the grid of calibrate-flat.yaml, a thousand at a time."""
    procedure = load_procedure(ROOT / "procedures/calibrate-flat.yaml")
    grid = next(step for step in procedure.steps if isinstance(step, CaptureGridStep))
    for block in range(blocks):
        rng = np.random.default_rng([SEED, block])
        yield study.run(rig, np.array(grid.standoffs_mm), grid.repeats, BLOCK, rng)
        print(f"{BLOCK * (block + 1)} calibrations", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
