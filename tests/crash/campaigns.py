"""Campaigns as commands, their worker processes, and hashes of their results."""

from __future__ import annotations

import hashlib
import subprocess
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path

import numpy as np
import psutil

from tests.support.command_line import SCRIPT

LONGEST_S = 120
"""Longest wait for a chunk."""


def start(campaign: Path, out: Path, *options: str) -> subprocess.Popen[str]:
    """The command in a group of its own, as at a terminal."""
    command = [str(SCRIPT), "campaign", str(campaign), "-o", str(out), *options]
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)


def wait_for(what: Callable[[], bool], process: subprocess.Popen[str], longest_s: float = LONGEST_S) -> None:
    """Wait until something holds while a process runs."""
    end_s = time.monotonic() + longest_s
    while not what():
        assert process.poll() is None, process.communicate()[1]
        assert time.monotonic() < end_s
        time.sleep(0.01)


def finished(out: Path) -> int:
    """Number of chunks that are finished."""
    return len(list(out.glob("chunks/*.sha256")))


def have_finished(out: Path, chunks: int) -> bool:
    """Whether a number of chunks is finished."""
    return finished(out) >= chunks


def workers(pid: int | None = None) -> list[psutil.Process]:
    """Worker processes of a process: they are spawned, other children of multiprocessing are not."""
    found = []
    for child in psutil.Process(pid).children(recursive=True):
        with suppress(psutil.Error):  # it has ended
            if any("spawn_main" in word for word in child.cmdline()):
                found.append(child)
    return found


def kill_workers(
    process: subprocess.Popen[str], out: Path, after: list[int], rng: np.random.Generator, longest_s: float
) -> None:
    """Kill a worker, chosen at random, whenever one of these numbers of chunks is finished."""
    for chunks in sorted(after):
        wait_for(partial(have_finished, out, chunks), process, longest_s)
        wait_for(lambda: bool(workers(process.pid)), process)
        alive = workers(process.pid)
        alive[rng.integers(len(alive))].kill()


def results(out: Path) -> dict[str, str]:
    """Hashes of all chunks and tables."""
    paths = [*out.glob("chunks/*"), *out.glob("tables/*")]
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(paths)}
