"""A cold `workbench fit` of 480 pixel positions over a minimal script of numpy and scipy.optimize.

From the start of the process to its end; the runs alternate, and the fastest counts: whatever else the
machine does only adds. The workbench's first run, with an empty cache, is shown as well. Both fit the same
terms.

The script runs twice: as anybody would call it, and told that one thread is enough for matrices as small as
these (OpenBLAS starts one for each core, and they wait for each other). The workbench tells itself.
"""

from __future__ import annotations

import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tests.proofs import simulate
from workbench.model.calibration import load_calibration
from workbench.model.rig import Rig, load_rig

ROOT = Path(__file__).parents[2]
RIG = ROOT / "rigs/thesis-emulated.yaml"
STANDOFFS_MM = np.array([125.0, 150, 180, 210, 280, 400, 600, 900, 1400, 2200, 3200, 4500])
REPEATS = 10
RUNS = 15
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


class Took(NamedTuple):
    """A run, seconds."""

    wall: float
    processor: float


def lines() -> Iterator[str]:
    """The table, line by line."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        count = write_captures(load_rig(RIG), folder / "captures.csv")
        ours, scipys = folder / "ours.yaml", folder / "scipy.yaml"
        fit = [str(Path(sys.executable).parent / "workbench"), "fit", str(folder / "captures.csv")]
        fit += ["--rig", str(RIG), "-o", str(ours)]
        script = [sys.executable, str(Path(__file__).with_name("minimal_fit.py"))]
        script += [str(folder / "captures.csv"), str(scipys)]
        environment = os.environ | {"XDG_CACHE_HOME": str(folder / "cache")}
        # Modules of an installed program are compiled; where this is forbidden our own would be, every time.
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        plain = {name: value for name, value in environment.items() if name not in THREADS}
        one_thread = plain | dict.fromkeys(THREADS, "1")
        first = seconds(fit, plain)
        runs = [
            (seconds(fit, plain), seconds(script, plain), seconds(script, one_thread)) for _ in range(RUNS)
        ]
        ours_took, as_called, with_one = (
            Took(*map(min, zip(*one, strict=True))) for one in zip(*runs, strict=True)
        )
        off = distance_sd(ours, scipys)
    yield f"A cold fit of {count} pixel positions, start of the process to its end; seconds, the fastest of"
    yield f"{RUNS} runs that alternate; both fit the same terms, ours then weighs them, checks and prints"
    yield f"{'':52}{'wall':>6}{'processor':>11}{'ratio':>7}{'of processor':>14}"
    yield f"{'workbench fit':52}{ours_took.wall:6.2f}{ours_took.processor:11.2f}"
    for name, script_took in (("as called", as_called), ("with one thread", with_one)):
        ratio, processor = ours_took.wall / script_took.wall, ours_took.processor / script_took.processor
        of = f"minimal script of numpy and scipy, {name}"
        yield f"{of:52}{script_took.wall:6.2f}{script_took.processor:11.2f}{ratio:7.2f}{processor:14.2f}"
    yield f"target of the wall's ratio, with one thread: at most 2; the two optima differ by {off:.1e} sd"
    yield f"the very first fit, which compiles: {first.wall:.2f}"


def write_captures(rig: Rig, path: Path) -> int:
    """Write the positions of one simulated calibration, and count them."""
    rng = np.random.default_rng(12)
    truth = simulate.draw_truths(rig, 1, rng)
    truth[:, 3:5] = 0.0  # every spot in the frame
    truth[:, 1:3] = 319.5, 239.5
    z0 = simulate.depths(rig, truth, STANDOFFS_MM, rng.normal(0.0, 0.3, (1, len(STANDOFFS_MM))))
    centre = simulate.spots(rig, truth, z0, simulate.tilted(rig, truth, np.zeros((*z0.shape, 2))))[0]
    centre = centre + rng.normal(0.0, rig.noise.speckle_sd_px, centre.shape)
    rows = ["laser_id,standoff_mm,repeat,u_px,v_px"]
    for standoff, spots in zip(STANDOFFS_MM, centre, strict=True):
        for laser, spot in zip(rig.laser_ids, spots, strict=True):
            for repeat in range(REPEATS):
                u, v = spot + rng.normal(0.0, rig.noise.spot_sd_px, 2)
                rows.append(f"{laser},{standoff:g},{repeat},{float(u)!r},{float(v)!r}")
    path.write_text("\n".join(rows) + "\n")
    return len(rows) - 1


def seconds(command: Sequence[str], environment: Mapping[str, str]) -> Took:
    """How long the command runs; its output is dropped."""
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, check=True, env=environment, capture_output=True)
    wall, after = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    return Took(wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


def distance_sd(ours: Path, scipys: Path) -> float:
    """Largest difference of a parameter between the files, in standard deviations."""
    parameters = load_calibration(ours).laser_ranger.parameters
    free = np.array(parameters.prior_sd) > 0
    match = re.search(r"values: \[(.*)\]", scipys.read_text())
    assert match
    theirs = np.array([float(text) for text in match[1].split(",")])
    return float(np.abs((np.array(parameters.values)[free] - theirs) / np.array(parameters.sd)[free]).max())
