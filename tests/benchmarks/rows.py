"""Time of `workbench fit` and `workbench range` over the number of rows, relative to the smallest file.

Processor time of whole processes, the smallest of RUNS. Most of a small fit is start-up; what grows has
to grow linearly. The repeats of each spot grow, not the spots.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage

import numpy as np

from tests.support.rigs import World
from workbench.model.rig import load_rig

ROOT = Path(__file__).parents[2]
RIG = ROOT / "rigs/thesis-emulated.yaml"
WORKBENCH = Path(sys.executable).with_name("workbench")
Command = Sequence[str | Path]
ROWS = (440, 4_400, 17_600, 44_000, 100_000)
SCENES = (100, 1_000, 5_000, 25_000)
SCENE_RANGE_MM = (300.0, 3000.0)
RUNS = 3


def lines() -> Iterator[str]:
    """The tables, line by line."""
    world = World(load_rig(RIG), 1)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        fit: Command = [WORKBENCH, "fit", folder / "rows.csv", "--rig", RIG, "-o", folder / "c.yaml"]
        yield "rows of captures.csv    fit, s of processor   relative to the first"
        yield from _table(ROWS, fit, lambda count: write_rows(world, folder / "rows.csv", count))
        ranging: Command = [WORKBENCH, "range", folder / "scenes.csv", "--calibration", folder / "c.yaml"]
        yield "scenes of four lasers   range, s of processor   relative to the first"
        yield from _table(SCENES, ranging, lambda count: write_scenes(world, folder / "scenes.csv", count))


def _table(counts: Sequence[int], command: Command, write: Callable[[int], None]) -> Iterator[str]:
    first: float | None = None
    for count in counts:
        write(count)
        took_s = min(_processor_s(command) for _ in range(RUNS))
        first = first or took_s
        yield f"{count:20d}   {took_s:19.2f}   {took_s / first:8.1f}"


def _processor_s(command: Command) -> float:
    before = getrusage(RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = getrusage(RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def write_rows(world: World, path: Path, count: int) -> None:
    """Write a captures file of about `count` pixel positions: the spots of eleven standoffs, repeated."""
    observations = world.observations(repeats=max(1, round(count / 44)))
    rows = (f"{s.laser_id},{s.standoff_mm:g},{s.repeat},{s.u_px:.4f},{s.v_px:.4f}\n" for s in observations)
    path.write_text("laser_id,standoff_mm,repeat,u_px,v_px\n" + "".join(rows))


def write_scenes(world: World, path: Path, count: int) -> None:
    """Write `count` scenes of a flat target at random ranges."""
    rng = np.random.default_rng(2)
    rows = []
    for scene in range(count):
        range_mm = float(rng.uniform(*SCENE_RANGE_MM))
        for laser in world.rig.laser_ids:
            u, v = world.pixel(laser, range_mm) + rng.normal(0, 0.05, 2)
            rows.append(f"{laser},,0,{u:.4f},{v:.4f},s{scene}\n")
    path.write_text("laser_id,standoff_mm,repeat,u_px,v_px,scene\n" + "".join(rows))


if __name__ == "__main__":
    for line in lines():
        print(line, flush=True)
