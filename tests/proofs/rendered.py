"""Verifications of changed sensors on the virtual bench: whole sessions, from rendered frames.

One session for each change, of the sensor of `rigs/thesis-emulated.yaml` with a calibration of its unchanged
truth. Ruler and mount are then those of the calibration.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
from ruamel.yaml import YAML

from tests.bench.sensors import calibration_of
from workbench.calibration.verdict.export import render
from workbench.emulator.spec import emulator_spec
from workbench.emulator.truth import draw_truth
from workbench.model.errors import LimitFailedError
from workbench.model.rig import load_rig

ROOT = Path(__file__).parents[2]
RIG = ROOT / "rigs/thesis-emulated.yaml"
SCRIPT = Path(sys.executable).with_name("workbench")
PROCEDURE = """\
format: 1
procedure: verify
title: Verify
steps:
  - step: verify_trial
    standoffs_mm: [200, 300, 500, 800, 1200, 2000]
    readings: 5
    same_bench: true
"""

CHANGES: dict[str, tuple[dict[str, float], str]] = {
    "one laser turned by 1 mrad": ({"L2.tx": 0.001}, "L2 turned"),
    "focal length 0.3 %": ({"f_px": 0.003 * 533.3}, "focal length"),
    "one baseline 0.3 mm": ({"L3.x_mm": 0.3}, "L3 displaced"),
    "camera turned by 2 mrad": ({"cx_px": 1.07}, "camera turned"),
    "lens refocused: 0.5 %, pinhole 2 mm": ({"f_px": 0.005 * 533.3, "offset_mm": 2.0}, "refocused"),
}
"""Changes of a sensor since its calibration by name, and the part of the verdict that names each."""


@dataclass(frozen=True)
class Verification:
    """Outcome of one session."""

    change: str
    refused: bool
    verdict: str


def verifications(changes: Mapping[str, Mapping[str, float]]) -> Iterator[Verification]:
    """A session for each change of the true parameters by name, as `L2.tx` or `f_px`; none: a valid one."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "verify.yaml").write_text(PROCEDURE)
        (folder / "c.yaml").write_text(render(calibration_of(load_rig(RIG))))
        for number, (text, change) in enumerate(changes.items()):
            yield _session(folder, number, text, change)


def _session(folder: Path, number: int, text: str, change: Mapping[str, float]) -> Verification:
    rig, sessions = folder / f"{number}.yaml", folder / f"sessions-{number}"
    _write_changed(rig, change)
    files = [folder / "verify.yaml", "--rig", rig, "--calibration", folder / "c.yaml"]
    command = [SCRIPT, "run", *files, "--sessions", sessions]
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode in (0, LimitFailedError.exit_code), done.stderr
    (table,) = sessions.glob("*/verify.1-verdict.csv")
    return Verification(text, done.returncode != 0, str(pd.read_csv(table)["verdict"].iloc[0]))


def _write_changed(file: Path, change: Mapping[str, float]) -> None:
    """Rig file whose virtual bench has a changed truth; what is not changed is drawn as before."""
    yaml = YAML()
    document, rig = yaml.load(RIG.read_text()), load_rig(RIG)
    truth = draw_truth(rig, emulator_spec(rig))
    pins: dict[str, Any] = {}
    for name, by in change.items():
        laser, _, key = name.rpartition(".")
        if laser:
            pins.setdefault("lasers", {})[laser] = {key: getattr(truth.lasers[laser], key) + by}
        else:
            pins[name] = getattr(truth, name) + by
    document["emulator"]["truth"] = pins
    with file.open("w") as out:
        yaml.dump(document, out)
