"""Speed of calibrations: a batch over a loop of scipy's, a cold `workbench fit` over a minimal script."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from tests.benchmarks import cold

ROOT = Path(__file__).parents[2]


def lines() -> Iterator[str]:
    """The table, line by line."""
    ran = subprocess.run(
        [sys.executable, "-m", "tests.benchmarks.batch"], cwd=ROOT, check=True, capture_output=True, text=True
    )
    figures = json.loads(ran.stdout)
    ratio = figures["scipy_s"] / figures["ours_s"]
    yield "A batch of 2000 calibrations (56 free parameters, 44 cells) and a loop of"
    yield "scipy.optimize.least_squares, default settings, on the same residuals in numpy; one core, one run."
    yield f"{'':>24}{'scipy':>12}{'ours':>12}"
    yield f"{'a fit, microseconds':>24}{1e6 * figures['scipy_s']:12.0f}{1e6 * figures['ours_s']:12.0f}"
    yield f"{'off the optimum, sd':>24}{figures['scipy_off_sd']:12.1e}{figures['ours_off_sd']:12.1e}"
    yield f"ratio {ratio:.0f} (target >= 100; ours off the optimum: target <= 1e-6)"
    yield f"first call, compiling or loading: {figures['compile_s']:.1f} s more"
    yield f"peak memory {figures['peak_gib']:.2f} GiB (target <= 1)"
    yield ""
    yield from cold.lines()
