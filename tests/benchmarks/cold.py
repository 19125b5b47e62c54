"""A cold `workbench fit` of 480 pixel positions over a minimal script of numpy and scipy.optimize.

From the start of the process to the file on the disk; the runs alternate, and the fastest counts: whatever
else the machine does only adds. The workbench's first run, with an empty cache, is told as well.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from tests.proofs import simulate
from workbench.model.calibration import load_calibration
from workbench.model.rig import Rig, load_rig

ROOT = Path(__file__).parents[2]
RIG = ROOT / "rigs/thesis-emulated.yaml"
STANDOFFS_MM = np.array([125.0, 150, 180, 210, 280, 400, 600, 900, 1400, 2200, 3200, 4500])
REPEATS = 10
RUNS = 9


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
        first = seconds(fit, environment)
        pairs = [(seconds(fit, environment), seconds(script, environment)) for _ in range(RUNS)]
        workbench, minimal = (min(part) for part in zip(*pairs, strict=True))
        off = distance_sd(ours, scipys)
    yield f"A cold fit of {count} pixel positions, start of the process to the file on disk; seconds,"
    yield f"the fastest of {RUNS} runs that alternate"
    yield f"minimal script of numpy and scipy.optimize {minimal:.2f}"
    yield f"workbench fit {workbench:.2f}; the very first one, which compiles, {first:.2f}"
    yield f"ratio {workbench / minimal:.2f} (target <= 2); the two optima differ by {off:.1e} sd"


def write_captures(rig: Rig, path: Path) -> int:
    """Write the positions of one simulated calibration, and count them."""
    rng = np.random.default_rng(12)
    truth = simulate.draw_truths(rig, 1, rng)
    truth[:, 3:5] = 0.0  # every spot in the frame
    truth[:, 1:3] = 319.5, 239.5
    z0 = simulate.depths(truth, STANDOFFS_MM, rng.normal(0.0, 0.3, (1, len(STANDOFFS_MM))))
    centre = simulate.spots(truth, z0, np.zeros((*z0.shape, 2)))[0]
    centre = centre + rng.normal(0.0, rig.noise.speckle_sd_px, centre.shape)
    rows = ["laser_id,standoff_mm,repeat,u_px,v_px"]
    for standoff, spots in zip(STANDOFFS_MM, centre, strict=True):
        for laser, spot in zip(rig.laser_ids, spots, strict=True):
            for repeat in range(REPEATS):
                u, v = spot + rng.normal(0.0, rig.noise.spot_sd_px, 2)
                rows.append(f"{laser},{standoff:g},{repeat},{float(u)!r},{float(v)!r}")
    path.write_text("\n".join(rows) + "\n")
    return len(rows) - 1


def seconds(command: Sequence[str], environment: Mapping[str, str]) -> float:
    """How long the command runs; its output is dropped."""
    begin = time.perf_counter()
    subprocess.run(command, check=True, env=environment, capture_output=True)
    return time.perf_counter() - begin


def distance_sd(ours: Path, scipys: Path) -> float:
    """Largest difference of a parameter between the files, in standard deviations."""
    parameters = load_calibration(ours).laser_ranger.parameters
    free = np.array(parameters.prior_sd) > 0
    match = re.search(r"values: \[(.*)\]", scipys.read_text())
    assert match
    theirs = np.array([float(text) for text in match[1].split(",")])
    return float(np.abs((np.array(parameters.values)[free] - theirs) / np.array(parameters.sd)[free]).max())
