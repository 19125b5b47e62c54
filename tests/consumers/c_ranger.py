"""The example ranger in C, built and run."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from tests.consumers.calibrations import missing
from workbench.model.arrays import FloatArray, Image

SOURCES = Path(__file__).parents[2] / "examples/c_ranger"
CHECKED = "-O1 -g -fsanitize=address,undefined -fno-sanitize-recover=all"
"""Memory errors and undefined behaviour end the program."""


def build(folder: Path, *options: str) -> Path:
    """The program, built in a copy of its sources."""
    if shutil.which("cc") is None or shutil.which("make") is None:
        missing("C compiler, or no make")
    own = Path(shutil.copytree(SOURCES, folder / "c_ranger", ignore=shutil.ignore_patterns("ranger", "*.o")))
    flags = " ".join([CHECKED, *options])
    subprocess.run(["make", "-s", "-C", own, f"CFLAGS={flags}"], check=True)
    return own / "ranger"


def run(program: Path, *arguments: Path | str, given: str = "") -> subprocess.CompletedProcess[str]:
    """Run it to its end, without judging how it ended."""
    return subprocess.run(
        [program, *arguments], input=given, capture_output=True, text=True, timeout=60, check=False
    )


def spot_lines(lasers: Sequence[str], position_px: FloatArray, sd_px: FloatArray) -> str:
    """Lines `laser u v sd_u sd_v` with all digits."""
    rows = zip(lasers, position_px.tolist(), sd_px.tolist(), strict=True)
    return "".join(f"{laser} {u!r} {v!r} {su!r} {sv!r}\n" for laser, (u, v), (su, sv) in rows)


def write_pgm(path: Path, image: Image) -> Path:
    cv2.imwrite(str(path), image)
    return path


def read_grey(path: Path) -> Image:
    """(height, width) grey values of a stored frame of 8 bits."""
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert image is not None
    return image.astype(np.uint8)
