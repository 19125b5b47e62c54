"""Speed, efficiency and memory of `workbench campaign`: python -m tests.benchmarks.campaigns

Simulated calibrations of procedures/campaigns/thesis.yaml, and an archive of copies of the reference session,
each with an identity of its own. Rates are those between the first and the last chunk, without the start of
the workers; times are those of the whole command.
"""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import psutil

from tests.support.reference_session import repeated
from tests.support.stored_output import store
from workbench.campaign.session_rows import NO_FIT

ROOT = Path(__file__).parents[2]
CAMPAIGN = ROOT / "procedures/campaigns/thesis.yaml"
SIZES = (10_000, 30_000, 100_000)
CHUNK, REFIT_CHUNK = 1000, 4
"""Numbers of calibrations and of sessions of a chunk: the defaults of the campaign file."""
SMALL = 16_000
"""Number of calibrations by one worker."""
TARGET = 1_000_000
ARCHIVE, ARCHIVE_TARGET = 200, 1000
"""Numbers of sessions: of the archive that is refitted, and of the one that is extrapolated."""
REFIT = """format: 1
campaign: archive
title: Archive
work: {kind: refit, sessions: sessions}
"""
POLL_S = 0.2
MIB = 2**20


@dataclass(frozen=True)
class Measured:
    """One run of the command."""

    items: int
    workers: int
    seconds: float
    rate: float
    """Items per second, all workers."""
    client_mib: float
    """Peak of the resident memory of the client."""
    worker_mib: float
    """The same of the largest worker."""
    processor_s: float
    """Processor time of the workers between the first and the last chunk, for each item."""


def measured(folder: Path, sensors: int, workers: int) -> Measured:
    """Run the campaign of simulated calibrations in a folder."""
    text = CAMPAIGN.read_text().replace("../../rigs", str(ROOT / "rigs"))
    if f"sensors: {SIZES[-1]}" not in text:
        raise ValueError(f"{CAMPAIGN}: expected {SIZES[-1]} sensors")
    name = f"{sensors}-{workers}"
    path, out = folder / f"{name}.yaml", folder / name
    path.write_text(text.replace(f"sensors: {SIZES[-1]}", f"sensors: {sensors}"))
    return _run(path, out, sensors, sensors // CHUNK, workers)


def measured_archive(folder: Path, workers: int) -> tuple[Measured, int]:
    """Refit an archive whose files are not in memory; also the bytes of its files."""
    path, sessions = folder / "archive.yaml", folder / "sessions"
    path.write_text(REFIT)
    sessions.mkdir()
    for n in range(ARCHIVE):
        repeated(sessions, f"{n:06d}-reference", n + 1, frames=True)
    os.sync()
    size = 0
    for file in sessions.rglob("*"):
        if file.is_file():
            size += file.stat().st_size
            with file.open("rb") as opened:
                os.posix_fadvise(opened.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
    found = _run(path, folder / "archive", ARCHIVE, ARCHIVE // REFIT_CHUNK, workers)
    rows = pd.concat([pd.read_parquet(one) for one in folder.glob("archive/chunks/*.parquet")])
    if (rows["now"] == NO_FIT).any():
        raise RuntimeError(f"expected a fit of every session, got {rows['reason'].unique()}")
    return found, size


def _run(path: Path, out: Path, items: int, chunks: int, workers: int) -> Measured:
    """Run a campaign."""
    command = [str(Path(sys.executable).with_name("workbench")), "campaign", str(path), "-o", str(out)]
    began_s = time.monotonic()
    messages = path.with_suffix(".txt")
    with messages.open("wb") as file:
        process = subprocess.Popen([*command, "--workers", str(workers)], stderr=file)
    client, peaks = psutil.Process(process.pid), {"client": 0.0, "worker": 0.0}
    used: list[tuple[int, float]] = []
    while process.poll() is None:
        peaks["client"] = max(peaks["client"], _peak_mib(client))
        children = _children(client)
        for child in children:
            peaks["worker"] = max(peaks["worker"], _peak_mib(child))
        done = len(list(out.glob("chunks/*.sha256")))
        if workers <= done < chunks:
            used.append((done, sum(map(_processor_s, children))))
        time.sleep(POLL_S)
    seconds = time.monotonic() - began_s
    if process.returncode:
        raise RuntimeError(f"{command}: exit code {process.returncode}: {messages.read_text()}")
    ends_s = sorted(path.stat().st_mtime for path in out.glob("chunks/*.sha256"))
    rate = (len(ends_s) - workers) / (ends_s[-1] - ends_s[workers - 1]) * items / len(ends_s)
    (first, before_s), (last, after_s) = used[0], used[-1]
    processor_s = (after_s - before_s) / ((last - first) * items / chunks)
    return Measured(items, workers, seconds, rate, peaks["client"], peaks["worker"], processor_s)


def lines() -> list[str]:
    """Table, efficiency and extrapolation of simulated calibrations."""
    with tempfile.TemporaryDirectory() as folder:
        one = measured(Path(folder), SMALL, 1)
        two = [measured(Path(folder), sensors, 2) for sensors in SIZES]
    sizes, seconds = np.array(SIZES), np.array([run.seconds for run in two])
    slope, start = np.polyfit(sizes, seconds, 1)
    off = np.abs(seconds / (start + slope * sizes) - 1).max()
    names = ("calibrations", "workers", " time s", " per s", "client MiB", "worker MiB", "processor ms")
    found = [" ".join(names)]
    found += [
        f"{run.items:>12} {run.workers:>7} {run.seconds:>7.0f} {run.rate:>6.0f} {run.client_mib:>10.0f}"
        f" {run.worker_mib:>10.0f} {1000 * run.processor_s:>12.2f}"
        for run in (one, *two)
    ]
    return [
        *found,
        "",
        f"calibrations per second and core: {one.rate:.0f}",
        f"efficiency of two workers: {100 * two[-1].rate / (2 * one.rate):.0f} % of one times two; by the"
        f" processor time of a calibration {100 * one.processor_s / two[-1].processor_s:.0f} %",
        f"time: {start:.0f} s + {1000 * slope:.2f} ms for each calibration; off this line by at most"
        f" {100 * off:.1f} %",
        f"{TARGET} calibrations on two cores, extrapolated: {(start + slope * TARGET) / 60:.0f} min",
    ]


def archive_lines() -> list[str]:
    """Time of a session in an archive that is refitted."""
    with tempfile.TemporaryDirectory() as folder:
        archive, size = measured_archive(Path(folder), 2)
    return [
        f"archive of {ARCHIVE} sessions, {size / ARCHIVE / MIB:.1f} MiB each, read from the disk:"
        f" {archive.seconds:.0f} s,",
        f"between the first and the last chunk {1 / archive.rate:.3f} s each with two workers, who compute"
        f" {100 * archive.processor_s * archive.rate / 2:.0f} % of the time",
        f"{ARCHIVE_TARGET} sessions on two cores, extrapolated: {ARCHIVE_TARGET / archive.rate / 60:.0f} min",
    ]


def _peak_mib(process: psutil.Process) -> float:
    """Largest resident memory so far; 0 if the process has ended."""
    try:
        status = Path(f"/proc/{process.pid}/status").read_text()
    except OSError:
        return 0.0
    peaks = [int(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM")]
    return peaks[0] * 1024 / MIB if peaks else 0.0


def _processor_s(process: psutil.Process) -> float:
    """User and system time so far; 0 if the process has ended."""
    try:
        times = process.cpu_times()
    except psutil.Error:
        return 0.0
    return float(times.user + times.system)


def _children(process: psutil.Process) -> list[psutil.Process]:
    try:
        return list(process.children(recursive=True))
    except psutil.NoSuchProcess:
        return []


def main() -> None:
    """Run, print, write."""
    heading = f"Python {platform.python_version()}, {len(psutil.Process().cpu_affinity() or [])} cores"
    command = "python -m tests.benchmarks.campaigns"
    store("campaigns", "Campaigns", command, [heading, "", *lines()])
    store("campaign-archive", "Archive", command, [heading, "", *archive_lines()])


if __name__ == "__main__":
    main()
