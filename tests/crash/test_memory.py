"""Memory of a whole session with its recording: what it grows by for each capture of 640 x 480 pixels."""

from __future__ import annotations

import re
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from tests.support.command_line import SCRIPT

ROOT = Path(__file__).parents[2]
PROCEDURE = """format: 1
procedure: memory
title: Memory
steps:
  - step: capture_grid
    standoffs_mm: [200, 300, 400, 500, 600, 700, 800, 900, 1000, 1200, 1400, 1600, 1800, 2000, 2200]
    repeats: 25
"""
SETTLED = 300
"""Number of captures after which what is loaded once no longer counts."""
MOST_MB = 300.0
"""Most that a session of 10 000 captures may grow by."""


@pytest.mark.thorough
def test_ten_thousand_captures_grow_by_less_than_300_mb(tmp_path: Path) -> None:
    """By the slope over 1500."""
    (tmp_path / "p.yaml").write_text(PROCEDURE)
    rig = ROOT / "rigs/thesis-emulated.yaml"
    command: list[str | Path] = [SCRIPT, "run", tmp_path / "p.yaml", "--rig", rig]
    command += ["--sessions", tmp_path / "s", "--no-view"]
    samples: list[tuple[int, float]] = []
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        while process.poll() is None:
            status = Path(f"/proc/{process.pid}/status").read_text()
            if (resident := re.search(r"RssAnon:\s+(\d+) kB", status)) is not None:
                samples.append((_captures(tmp_path / "s"), int(resident[1]) / 1024))
            time.sleep(1.0)  # the interval of the samples
    assert process.returncode == 0
    counted = np.array([sample for sample in samples if sample[0] >= SETTLED])
    slope = np.polyfit(counted[:, 0], counted[:, 1], 1)[0]
    print(f"{1000 * slope:.1f} kB a capture, {10_000 * slope:.0f} MB for 10 000")
    assert counted[-1, 0] >= 1400
    assert 10_000 * slope < MOST_MB


def _captures(sessions: Path) -> int:
    return sum(1 for _ in sessions.glob("*/frames/**/*-off.png"))
