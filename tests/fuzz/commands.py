"""Whole commands on mutated inputs, each in a forked process: exit code, messages, time, memory, files.

The large libraries are imported once, before the forks; none of them has started a thread then.
"""

from __future__ import annotations

import math
import os
import random
import resource
import select
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module
from pathlib import Path

from tests.fuzz.doors import (
    CAPTURES,
    MOST_BYTES,
    MOST_CPU_S,
    PROCEDURE,
    READINGS,
    RIG,
    ROOT,
    SESSION,
)
from tests.fuzz.mutation import mutate_bytes
from tests.fuzz.outcome import Outcome
from workbench.model.calibration import load_calibration
from workbench.model.errors import WorkbenchError

LIBRARIES = (
    "workbench.cli.main",
    "workbench.cli.fit",
    "workbench.cli.range",
    "workbench.cli.compare",
    "workbench.cli.design",
    "workbench.cli.trial",
    "workbench.cli.sessions",
    "workbench.cli.check",
    "workbench.cli.plan",
    "optimistix",
    "pandas",
)
HERE = "s/20261129-174335-reference"
"""Session folder; its name must stay as at its start."""
MOST_WALL_S = 300.0
"""Limit of the clock on a busy computer; MOST_CPU_S is the limit that counts."""
BEFORE = b"written before\n"
CODES = {0, 2, 3, 4, 5, 6, 7}
ROWS = (ROOT / "data/webcam-laser-rows.csv").read_bytes()
WEBCAM = (ROOT / "rigs/webcam-laser.yaml").read_bytes()
SEEDS = {
    "rig.yaml": (RIG, WEBCAM),
    "procedure.yaml": (PROCEDURE,),
    "captures.csv": CAPTURES,
    "rows.csv": (ROWS,),
    "webcam.yaml": (WEBCAM,),
    "readings.csv": READINGS,
    "calibration.yaml": ((SESSION / "calibration.yaml").read_bytes(),),
    f"{HERE}/session.yaml": ((SESSION / "session.yaml").read_bytes(),),
    f"{HERE}/journal.jsonl": ((SESSION / "journal.jsonl").read_bytes(),),
    f"{HERE}/captures.csv": ((SESSION / "captures.csv").read_bytes(),),
}
COMMANDS: tuple[tuple[str, str], ...] = (
    ("rig.yaml", "check rig.yaml"),
    ("procedure.yaml", "check procedure.yaml"),
    ("procedure.yaml", "plan procedure.yaml --rig rig.yaml"),
    ("rows.csv", "fit rows.csv --rig webcam.yaml -o out/c.yaml"),
    ("rows.csv", "fit rows.csv --rig webcam.yaml -o out/c.yaml --json"),
    ("webcam.yaml", "fit rows.csv --rig webcam.yaml -o out/c.yaml --accept reason"),
    ("captures.csv", "range captures.csv --calibration calibration.yaml --json"),
    ("calibration.yaml", f"range {HERE}/captures.csv --calibration calibration.yaml"),
    ("calibration.yaml", f"compare calibration.yaml {HERE}/calibration.yaml"),
    ("webcam.yaml", "design --rig webcam.yaml --count 3 --repeats 2"),
    ("readings.csv", "trial accuracy readings.csv --json"),
    ("readings.csv", "trial gauge-rr readings.csv"),
    (f"{HERE}/journal.jsonl", "sessions s"),
    (f"{HERE}/session.yaml", f"fit {HERE} -o out/c.yaml"),
    (f"{HERE}/captures.csv", f"fit {HERE} -o out/c.yaml"),
    (f"{HERE}/journal.jsonl", f"repair {HERE} --leave-out reference.4/600mm --reason fuzz"),
    (f"{HERE}/session.yaml", f"resume {HERE}"),
    ("rig.yaml", "target --rig rig.yaml --pdf out/t.pdf"),
    ("rig.yaml", "lasers off --rig rig.yaml"),
    ("rig.yaml", "doctor rig.yaml --no-input"),
    ("rig.yaml", "run procedure.yaml --rig rig.yaml --sessions out"),
)
"""Mutated file, and the command that reads it."""


def fuzz_commands(folder: Path, count: int, number: int, end_s: float = math.inf) -> Outcome:
    """Run `count` commands on mutated files, the same for the same seed `number`; none after `end_s`."""
    for name in LIBRARIES:
        import_module(name)
    rng, outcome = random.Random(number), Outcome()  # noqa: S311 - no secret
    for index in range(count):
        if time.monotonic() >= end_s:
            break
        mutated, line = COMMANDS[index % len(COMMANDS)]
        _lay_out(folder)
        content = mutate_bytes(SEEDS[mutated], rng)
        (folder / mutated).write_bytes(content)
        existing = folder / "out" / line.rpartition("out/")[2].split()[0]
        if "out/" in line and index % 2:
            existing.write_bytes(BEFORE)
        for what in _run(folder, line.split(), outcome, existing):
            outcome.found.setdefault(f"{line}: {what}", content)
    return outcome


def fuzz_part(count: int, number: int, end_s: float = math.inf) -> Outcome:
    """`fuzz_commands` in a folder of its own; nothing after `end_s`."""
    if time.monotonic() >= end_s:
        return Outcome()
    with tempfile.TemporaryDirectory() as folder:
        return fuzz_commands(Path(folder) / "here", count, number, end_s)


def _lay_out(folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "out").mkdir(parents=True)
    shutil.copytree(SESSION, folder / HERE)
    for name, (first, *_) in SEEDS.items():
        (folder / name).write_bytes(first)


def _run(folder: Path, arguments: Sequence[str], outcome: Outcome, existing: Path) -> list[str]:
    """What is wrong with one command."""
    out, err = folder / "stdout", folder / "stderr"
    before = set((folder / "out").iterdir())
    pid = os.fork()
    if pid == 0:
        _child(folder, arguments, out, err)
    ended = os.pidfd_open(pid)
    in_time = bool(select.select([ended], [], [], MOST_WALL_S)[0])
    os.close(ended)
    if not in_time:
        os.kill(pid, signal.SIGKILL)
    _, status, usage = os.wait4(pid, 0)
    code = os.waitstatus_to_exitcode(status)
    outcome.results[f"exit {code}:"] += 1
    wrong = [] if code in CODES else [f"exit code {code}: {_last_line(err)}"]
    if b"Traceback (most recent call last)" in err.read_bytes():
        wrong.append(f"traceback: {_last_line(err)}")
    if not in_time or usage.ru_utime + usage.ru_stime > MOST_CPU_S:
        wrong.append(f"more than {MOST_CPU_S:g} s")
    if usage.ru_maxrss * 1024 > MOST_BYTES:
        wrong.append(f"{usage.ru_maxrss / 1024:.0f} MiB")
    return [*wrong, *_half_written(folder / "out", before, existing, code)]


def _half_written(out: Path, before: set[Path], existing: Path, code: int) -> list[str]:
    """Files of a calibration that are neither whole nor as they were; temporary files that were left."""
    left = [path.name for path in out.iterdir() if path.is_file() and path not in {*before, existing}]
    wrong = [f"left in the folder: {', '.join(left)}"] if left else []
    if existing.suffix == ".yaml" and existing.is_file():
        if code == 0:
            try:
                load_calibration(existing)
            except WorkbenchError as error:
                wrong.append(f"written, but cannot be read: {str(error).splitlines()[0]}")
        elif existing.read_bytes() != BEFORE:
            wrong.append(f"written, but the exit code is {code}")
    return wrong


def _last_line(err: Path) -> str:
    lines = err.read_text(errors="replace").splitlines()
    places = [one.strip() for one in lines if one.startswith('  File "') and "/workbench/" in one]
    errors = [one for one in lines if one and not one.startswith((" ", "internal error"))]
    return " ".join([*errors[-1:], *places[-1:]])[:300]


def _child(folder: Path, arguments: Sequence[str], out: Path, err: Path) -> None:
    """Run the command and end; never returns."""
    try:
        os.setsid()
        signal.alarm(int(MOST_WALL_S))
        limit = int(2 * MOST_CPU_S)
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
        for number, path in ((0, Path(os.devnull)), (1, out), (2, err)):
            os.dup2(os.open(path, os.O_RDWR | os.O_CREAT | os.O_TRUNC, 0o600), number)
        os.chdir(folder)
        sys.stdin, sys.stdout, sys.stderr = (
            os.fdopen(number, mode, encoding="utf-8", closefd=False)
            for number, mode in ((0, "r"), (1, "w"), (2, "w"))
        )
        sys.argv = ["workbench", *arguments]
        from workbench.cli.main import main

        main()
        code = 0
    except SystemExit as error:
        code = error.code if isinstance(error.code, int) else 1
    except BaseException:
        traceback.print_exc()
        code = 1
    finally:
        with suppress(BaseException):
            sys.stdout.flush()
            sys.stderr.flush()
    os._exit(code)
