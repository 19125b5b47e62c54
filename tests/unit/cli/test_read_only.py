"""Commands on a file system that cannot be written; mounted for the test, which only root may do."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.command_line import SCRIPT

ROOT = Path(__file__).parents[3]
SESSION = "20261129-174335-reference"
RIG = "rigs/thesis-emulated.yaml"
ROWS = "data/webcam-laser-rows.csv --rig rigs/webcam-laser.yaml"


@pytest.fixture
def read_only(tmp_path: Path) -> Iterator[Path]:
    folder = tmp_path / "ro"
    folder.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=20m", "tmpfs", folder], capture_output=True)
    if mounted.returncode != 0:
        pytest.skip("a file system can be mounted by root only")
    try:
        subprocess.run(["cp", "-r", ROOT / "data/session-0.1.0", folder / SESSION], check=True)
        subprocess.run(["mount", "-o", "remount,ro", folder], check=True)
        yield folder
    finally:
        subprocess.run(["umount", folder], check=True)


@pytest.mark.long_cases
@pytest.mark.parametrize(
    ("line", "code"),
    [
        (f"fit {ROWS} -o RO/c.yaml", 2),
        (f"fit {ROWS} -o TMP/c.yaml --recording RO/r.rrd", 2),
        ("target --pdf RO/t.pdf", 2),
        ("new RO/lab", 2),
        (f"run procedures/calibrate-flat.yaml --rig {RIG} --sessions RO --no-view", 5),
        (f"repair RO/{SESSION} --leave-out reference.4/600mm --reason x --no-view", 5),
        ("sessions RO", 0),
        (f"fit RO/{SESSION} -o TMP/c.yaml", 0),
    ],
)
def test_commands_end_with_a_code_for_the_user(read_only: Path, tmp_path: Path, line: str, code: int) -> None:
    words = [word.replace("RO", str(read_only), 1).replace("TMP", str(tmp_path), 1) for word in line.split()]
    ended = subprocess.run(
        [SCRIPT, *words], capture_output=True, text=True, cwd=ROOT, stdin=subprocess.DEVNULL
    )
    assert ended.returncode == code, ended.stderr
    assert "Traceback" not in ended.stderr
