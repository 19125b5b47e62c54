"""Outputs of sessions on the virtual bench, for the documentation; a minute or more each.

`python -m tests.tables.sessions demo` keeps what `make demo` prints, `python -m tests.tables.sessions 2001`
the thesis's hardware tests with this seed of the bench.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.support.stored_output import ROOT, store

CALIBRATE = "procedures/calibrate-flat.yaml"
HARDWARE_RIG, SEED = "rigs/thesis-emulated.yaml", "  seed: 2001\n"
"""Rig file, and its line with the seed of the bench."""
FIRST_TABLES = ("Accuracy:", "Thesis's hardware tests")
"""Beginnings of the first line that is kept."""


def printed(procedure: str, seed: int) -> list[str]:
    """Calibrate and run a procedure on a new bench; what the terminal shows, from the first table on."""
    with tempfile.TemporaryDirectory() as folder:
        rig = Path(folder) / "rig.yaml"
        rig.write_text((ROOT / HARDWARE_RIG).read_text().replace(SEED, f"  seed: {seed}\n"))
        shown = _run((CALIBRATE, procedure), rig, Path(folder)).replace(f"{folder}/", "").splitlines()
    return shown[next(n for n, line in enumerate(shown) if line.startswith(FIRST_TABLES)) :]


def _run(procedures: tuple[str, ...], rig: Path, folder: Path) -> str:
    """Run a session; what the terminal shows at 80 columns."""
    command = ["run", *procedures, "--rig", str(rig), "--sessions", str(folder / "sessions")]
    done = subprocess.run(
        [Path(sys.executable).with_name("workbench"), *command],
        cwd=ROOT,
        env=os.environ | {"COLUMNS": "80"},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stderr


def main(name: str) -> None:
    """Run, print, write."""
    command = f"python -m tests.tables.sessions {name}"
    if name == "demo":
        store("demo", "Output of make demo", command, printed("procedures/accuracy-flat.yaml", 2001))
    else:
        title = f"Thesis's hardware tests with seed {name}"
        store(f"thesis-{name}", title, command, printed("procedures/thesis-hardware.yaml", int(name)))


if __name__ == "__main__":
    main(sys.argv[1])
