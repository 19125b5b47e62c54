"""`python -m tests.proofs.crowded`: flats so far away that their spots crowd, from frames to the range.

Errors of spots that are fitted together are correlated, which the ranges' covariance leaves out: this tells
what that does to the shape. No speckle, which would hide it. Minutes; the table goes to docs/benchmarks.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

import numpy as np

from tests.benchmarks.ranging import RIG, Bench
from tests.support.stored_output import store
from workbench.model.rig import load_rig
from workbench.ranging.acquire import acquire

READINGS, SEED = 1000, 2001
WIDTH_PX = 1.5
"""Of the spots that the bench draws."""
FLATS_MM = (700.0, 2500.0, 3000.0, 3500.0, 4000.0)


def table(readings: int = READINGS) -> Iterator[str]:
    """One line for each flat."""
    rig = load_rig(RIG)
    rig = rig.model_copy(update={"noise": rig.noise.model_copy(update={"speckle_sd_px": 1e-4})})
    bench = Bench("u", rig)
    yield f"{'flat mm':>8}{'widths apart':>14}{'not told %':>12}{'rejected %':>12}{'scatter / stated':>18}"
    for flat in FLATS_MM:
        rng = np.random.default_rng([SEED, int(flat)])
        closest, stated, rejected = [], [], 0
        for _ in range(readings):
            found = _reading(bench, flat, rng)
            if found is None:
                continue
            kind, at, sd = found
            rejected += kind != "flat"
            if kind == "flat":
                closest.append(at)
                stated.append(sd)
        told = len(closest) + rejected
        apart = np.diff(np.sort([bench.world.pixel(i, flat)[0] for i in bench.ranger.sensor.ids])).min()
        yield (
            f"{flat:8.0f}{apart / WIDTH_PX:14.1f}{100 * (1 - told / readings):12.1f}"
            f"{100 * rejected / told:12.1f}{np.std(closest) / np.mean(stated):18.2f}"
        )


def _reading(bench: Bench, flat_mm: float, rng: np.random.Generator) -> tuple[str, float, float] | None:
    """Kind of shape, range of a flat, and the part of its sigma that comes from the spots, mm."""
    pair = bench.pair(lambda axis, x: flat_mm, bench.ranger.sensor.ids, rng)
    reading = acquire(bench.ranger, "", lambda fired: bench.finders[fired].find(*pair))
    if reading.flat_mm is None or reading.flat_spot_sd_mm is None:
        return None
    return reading.lines[0].shape.kind, reading.flat_mm, reading.flat_spot_sd_mm


def main() -> int:
    """Run, print, write."""
    lines = [
        f"seed {SEED}, {READINGS} readings each",
        "rejected: flats reported as another shape, at most 1 %. scatter: of the range, over its sigma",
        "by the spots alone; the calibration is the same in all readings. not told: no shape was told.",
        "",
        *table(),
    ]
    store("crowded", "Crowded spots", "python -m tests.proofs.crowded", lines)
    return 0


if __name__ == "__main__":
    sys.exit(main())
