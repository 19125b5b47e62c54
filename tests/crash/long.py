"""A session of two hours in simulated time, with faults at random: `python -m tests.crash.long [shots]`.

10 000 shots at some 0.7 s each are two hours at a bench; here a shot takes as long as it is computed, and the
camera has a sixteenth of the pixels. Faults come at random from a fixed seed: kills at any journal record,
stops, a disk that is full for a moment, placements captured again. After each the session is resumed, until
it ends. Then every shot is looked for, on disk and in the captures table, and the results are compared with
those of a session without faults.

Memory and file handles are measured in the session without faults, after the first tenth and at the end:
what grows there grows with the shots. `growth` takes it apart, at a smaller size, since that is slow.
"""

from __future__ import annotations

import csv
import errno
import gc
import hashlib
import os
import sys
import tempfile
import time
import tracemalloc
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from unittest.mock import patch

import numpy as np

from tests.crash.short import CALLER, RESUMER, results, story, write_files
from workbench.model import event as ev
from workbench.model.errors import RigNotReadyError, StoppedError
from workbench.model.prompt import Answer, Prompt
from workbench.procedure.engine.plan import Plan
from workbench.procedure.engine.resume import resume
from workbench.procedure.engine.run import run
from workbench.session.journal import Journal, read_journal
from workbench.session.state import effective

LASERS = 2
STANDOFFS = 50
FAULTS = ("kill", "stop", "disk full")
AMID_OLD = 0.25
"""Chance that a fault may come while a resumed session goes over what is there already."""
REDO = 0.1
"""Chance that the operator has the placement before captured again."""


KEPT_B = 4000
"""Most that a shot may leave in memory, bytes: its record with those of its two frames (2.4 kB) and its spot
(0.8 kB), which the fit needs. One frame kept would be 19 kB."""
MOST_KB = 8.0
"""The same as the system sees it, which gives memory in pieces: twice as much, and still no frame."""
FEWEST_TO_TELL = 1000
"""Shots from which on the system's pieces do not matter."""
TORN = b'{"n":'
"""What is left of a line that was being written."""
MOST_SLOW = 20
"""Times that a busy machine may miss a deadline of the rig's before that is a fault of the software."""


class KilledError(BaseException):
    """Stands for SIGKILL in this one process: nothing that the workbench does catches it and goes on."""


def procedure(shots: int, count: int = STANDOFFS) -> str:
    """One grid of so many shots, and its fit."""
    repeats = shots // (LASERS * count)
    standoffs = ", ".join(f"{s:.1f}" for s in np.geomspace(200, 2500, count))
    return (
        "format: 1\nprocedure: long\ntitle: Two hours\nsteps:\n"
        f"  - step: capture_grid\n    standoffs_mm: [{standoffs}]\n    repeats: {repeats}\n"
        "  - step: fit\n    limits: {max_relative_range_sd: 0.5}\n  - step: export\n"
    )


def write_coarse_files(folder: Path, shots: int, standoffs: int = STANDOFFS) -> Plan:
    """The short procedures' rig with pixels four times as wide, and nobody at the virtual bench."""
    rig, path = write_files(folder, procedure(shots, standoffs))
    text = rig.read_text()
    for fine, coarse in {
        "width_px: 640": "width_px: 160",
        "height_px: 480": "height_px: 120",
        "f_px: {value: 533.3, sd: 26.7}": "f_px: {value: 133.3, sd: 6.7}",
        "cx_px: {value: 319.5, sd: 40.0}": "cx_px: {value: 79.5, sd: 10.0}",
        "cy_px: {value: 239.5, sd: 40.0}": "cy_px: {value: 59.5, sd: 10.0}",
    }.items():
        assert fine in text
        text = text.replace(fine, coarse)
    rig.write_text(text + "  answers: false\n  sensor: {pitch_um: 30.0}\n")
    return Plan.load(rig, [path])


@dataclass
class Usage:
    """Resident memory (MB) and open files, by the number of shots."""

    samples: list[tuple[int, float, int]] = field(default_factory=list)
    shots: int = 0

    def __call__(self, record: ev.Record) -> None:
        """Look every 100 shots."""
        if isinstance(record.event, ev.CaptureTaken):
            self.shots += 1
            if self.shots % 100 == 0:
                gc.collect()
                pages = int(Path("/proc/self/statm").read_text().split()[1])
                files = len(list(Path("/proc/self/fd").iterdir()))
                self.samples.append((self.shots, pages * os.sysconf("SC_PAGE_SIZE") / 1e6, files))


@dataclass
class Weather:
    """Random faults, one at a time, each after a random number of records; none without `rng`.

    As a rule only what is new counts: a resumed session goes over thousands of records before that, and with
    a fault in each 1500 of those it would never come to its end. Now and then they count too.
    """

    rng: np.random.Generator | None = None
    mean_records: int = 0
    """Between two faults."""
    seen: Counter[str] = field(default_factory=Counter)
    left: int = 0
    fault: str = ""
    newest: int = -1
    """Number of the last record that was new."""
    counts_all: bool = False
    dead: bool = False
    """Whether the process that stands for the workbench has been killed: it writes no more."""

    def next_fault(self) -> None:
        """Draw the next, if there is to be one."""
        if self.rng is None:
            return
        self.fault = str(self.rng.choice(FAULTS))
        self.left = int(self.rng.geometric(1 / self.mean_records))
        self.counts_all = bool(self.rng.random() < AMID_OLD)

    def consumer(self, record: ev.Record) -> None:
        """Count down; a kill comes right after a record."""
        if record.n <= self.newest and not self.counts_all:
            return
        self.newest = max(self.newest, record.n)
        self.left -= 1
        if self.left == 0 and self.fault == "kill":
            self.seen["kill"] += 1
            self.dead = True
            raise KilledError

    def stopping(self) -> str | None:
        """A stop comes between two shots."""
        if self.left <= 0 and self.fault == "stop":
            self.seen["stop"] += 1
            return "stopped by chance"
        return None

    def check_disk(self) -> None:
        """A disk is full at a write."""
        if self.left <= 0 and self.fault == "disk full":
            self.seen["disk full"] += 1
            self.fault = "over"
            raise OSError(errno.ENOSPC, "No space left on device")

    def ask(self, prompt: Prompt) -> Answer:
        """An operator who now and then has the placement before captured again."""
        if self.rng is not None and "redo" in prompt.may and self.rng.random() < REDO:
            self.seen["redo"] += 1
            return Answer(action="redo", reason="chance", by="emulator")
        return Answer(value=None if prompt.quantity is None else prompt.quantity.usual, by="emulator")


def run_to_the_end(plan: Plan, session: Path, weather: Weather, *consumers: ev.Consumer) -> None:
    """Run, and resume after every fault, until the session ends."""
    whole = Journal.append

    def append(journal: Journal, event: ev.Event) -> ev.Record:
        if weather.dead:  # what the end of a session writes is not written by a killed one
            os.write(journal._file, TORN)
            raise KilledError
        try:
            weather.check_disk()
        except OSError as error:
            os.write(journal._file, TORN)  # what fitted
            journal._cut_back()
            raise StoppedError("the journal cannot be written: no space left on device") from error
        return whole(journal, event)

    with patch.object(Journal, "append", append):
        weather.next_fault()
        while True:
            try:
                if session.exists():
                    resume(session, [weather.consumer, *consumers], RESUMER, weather.stopping, weather)
                else:
                    run(plan, session, [weather.consumer, *consumers], CALLER, weather.stopping, weather)
            except RigNotReadyError:
                weather.seen["slow machine"] += 1  # nobody has drawn this one
                if weather.seen["slow machine"] > MOST_SLOW:
                    raise
            except (KilledError, StoppedError):
                weather.dead = False
                weather.next_fault()
            else:
                return


def lost_shots(session: Path, shots: int) -> int:
    """Shots of the procedure that are not on disk with the journal's hash, or not in the captures table."""
    taken = [r.event for r in effective(read_journal(session)) if isinstance(r.event, ev.CaptureTaken)]
    with (session / "captures.csv").open() as file:
        rows = {row["on"] for row in csv.DictReader(file)}
    good = 0
    for capture in taken:
        frames = [capture.on] if capture.off is None else [capture.on, capture.off]
        whole = all(hashlib.sha256((session / f.path).read_bytes()).hexdigest() == f.sha256 for f in frames)
        good += whole and capture.on.path in rows
    return shots - good


def hashes(session: Path) -> dict[str, str]:
    """Every result and frame."""
    return {name: hashlib.sha256(content).hexdigest() for name, content in results(session).items()}


def compare(shots: int, folder: Path, seed: int = 1, mean_records: int = 1500) -> list[str]:
    """Run both sessions; returns lines that tell how it went.

    Raises:
        AssertionError: a shot is lost, the results differ, or handles leak; what memory grows by is told.
    """
    plan = write_coarse_files(folder, shots)
    usage, began = Usage(), time.monotonic()
    fair, foul = folder / "fair/s", folder / "foul/s"
    calm = Weather()
    run_to_the_end(plan, fair, calm, usage)
    fair_s = time.monotonic() - began
    weather = Weather(np.random.default_rng(seed), mean_records)
    run_to_the_end(plan, foul, weather)
    assert lost_shots(foul, shots) == 0
    assert hashes(foul) == hashes(fair)
    assert _told(foul) == _told(fair)
    early = usage.samples[max(len(usage.samples) // 10, 1) - 1]
    late = usage.samples[-1]
    taken = sum(isinstance(r.event, ev.CaptureTaken) for r in read_journal(foul))
    assert late[2] <= early[2], f"file handles: {early[2]}, then {late[2]}"
    per_shot_kb = 1000 * (late[1] - early[1]) / max(late[0] - early[0], 1)
    assert shots < FEWEST_TO_TELL or per_shot_kb <= MOST_KB, f"memory grows by {per_shot_kb:.1f} kB a shot"
    return [
        f"{shots} shots in {fair_s:.0f} s without faults {dict(calm.seen) or ''}".rstrip(),
        f"faults: {dict(sorted(weather.seen.items()))}; {taken - shots} shots taken again, 0 lost",
        "calibration, tables and frames the same to the bit",
        f"memory {early[1]:.0f} MB after {early[0]} shots, {late[1]:.0f} MB after {late[0]}:"
        f" {per_shot_kb:.1f} kB a shot",
        f"open files {early[2]}, then {late[2]}",
    ]


def growth(shots: int, folder: Path) -> dict[str, float]:
    """Bytes that a shot of a session without faults leaves in memory, by the module that asked for them.

    Of 4 in 10 shots in the second half, when every program is compiled and a frame of each kind held.
    """
    begin, first, last = (int(shots * part) for part in (0.45, 0.5, 0.9))
    taken = 0
    snapshots: list[tracemalloc.Snapshot] = []

    def look(record: ev.Record) -> None:
        nonlocal taken
        if not isinstance(record.event, ev.CaptureTaken):
            return
        taken += 1
        if taken == begin:
            tracemalloc.start()
        if taken in {first, last}:
            gc.collect()
            snapshots.append(tracemalloc.take_snapshot())
        if taken == last:
            tracemalloc.stop()

    plan = write_coarse_files(folder, shots, standoffs=5)
    run_to_the_end(plan, folder / "traced/s", Weather(), look)
    before, after = snapshots
    return {
        each.traceback[0].filename: each.size_diff / (last - first)
        for each in after.compare_to(before, "filename")
    }


def _told(session: Path) -> list[ev.Event]:
    return [event for event in story(session) if not isinstance(event, ev.SetAside)]


def main() -> None:
    """Run it and print."""
    shots = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    with tempfile.TemporaryDirectory() as folder:
        print("\n".join(compare(shots, Path(folder))), flush=True)
    with tempfile.TemporaryDirectory() as folder:
        left = growth(1000, Path(folder))
    print(f"traced: a shot leaves {sum(left.values()):.0f} bytes (at most {KEPT_B}), most of it from")
    for name, size in sorted(left.items(), key=lambda each: -each[1])[:5]:
        print(f"  {size:6.0f} {'/'.join(Path(name).parts[-3:])}")
    assert sum(left.values()) <= KEPT_B


if __name__ == "__main__":
    main()
