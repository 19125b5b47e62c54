"""Fuzzing of every door, in at most ten minutes of two cores; the inputs that fail are kept.

python -m tests.fuzz [--inputs 100000] [--commands 500] [--seed 1]
"""

from __future__ import annotations

import argparse
import hashlib
import os
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from tests.fuzz import commands, doors

KEPT = Path("fuzz-findings")
PARTS = 10
"""Number of parts of a door's inputs, which the processes share."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Fuzz, print the numbers of inputs; returns 1 if something was found."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--inputs", type=int, default=100_000)
    parser.add_argument("--commands", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args(arguments)
    started = time.monotonic()
    found = [*_of_doors(asked.inputs, asked.seed), *_of_commands(asked.commands, asked.seed)]
    for content in found:
        KEPT.mkdir(exist_ok=True)
        (KEPT / hashlib.sha256(content).hexdigest()[:16]).write_bytes(content)
    where = f", inputs in {KEPT}/" if found else ""
    print(f"{len(found)} findings{where}, {time.monotonic() - started:.0f} s")
    return int(bool(found))


def _of_doors(total: int, seed: int) -> Iterator[bytes]:
    counts, done = doors.counts(total), 0
    with ProcessPoolExecutor(os.cpu_count(), get_context("spawn"), doors.quiet_decoders) as pool:
        for name, count in counts.items():
            parts = list(doors.shares(count, min(PARTS, count)))
            seeds = range(seed * PARTS, seed * PARTS + len(parts))
            outcomes = list(pool.map(doors.fuzz_part, [name] * len(parts), parts, seeds))
            read, refused = sum(one.read for one in outcomes), sum(one.refused for one in outcomes)
            total = sum(one.total for one in outcomes)
            found = {what: content for one in outcomes for what, content in one.found.items()}
            done += total
            print(f"{name:15s} {total:7d}   read {read}, refused {refused}", flush=True)
            for line in doors.first_lines(found, len(found)):
                print(f"    {line}")
            yield from found.values()
    print(f"all doors       {done:7d}")


def _of_commands(total: int, seed: int) -> Iterator[bytes]:
    parts = list(doors.shares(total, os.cpu_count() or 1))
    with ProcessPoolExecutor(len(parts), get_context("spawn")) as pool:
        for outcome in pool.map(commands.fuzz_part, parts, range(seed, seed + len(parts))):
            print("\n    ".join(commands.report(outcome)), flush=True)
            yield from outcome.found.values()


if __name__ == "__main__":
    sys.exit(main())
