"""Fuzzing of every door and of whole commands within a limit of time; the inputs that fail are kept.

python -m tests.fuzz [--inputs 100000] [--commands 500] [--seed 1] [--minutes 10]
"""

from __future__ import annotations

import argparse
import hashlib
import multiprocessing
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from tests.fuzz import commands, doors
from tests.fuzz.outcome import Outcome, Sum

KEPT = Path("fuzz-findings")
PARTS = 20
"""Number of parts of a door's inputs. The doors take turns: each has its share when the time is over."""
DOORS_SHARE = 0.6
"""Share of the time for the doors; the commands have the rest, and what the doors leave."""
GRACE_S = 15.0
"""Time within the limit for the inputs that are being read at the deadline."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Fuzz, print the numbers that were run; returns 1 if something was found or a number was not reached."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--inputs", type=int, default=100_000)
    parser.add_argument("--commands", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=10.0, help="hard limit of the whole run")
    asked = parser.parse_args(arguments)
    started, limit_s = time.monotonic(), 60.0 * asked.minutes
    sums = _of_doors(asked.inputs, asked.seed, started + DOORS_SHARE * limit_s)
    sums["commands"] = _of_commands(asked.commands, asked.seed, started + limit_s)
    found = [content for one in sums.values() for content in one.found.values()]
    for content in found:
        KEPT.mkdir(exist_ok=True)
        (KEPT / hashlib.sha256(content).hexdigest()[:16]).write_bytes(content)
    where = f", inputs in {KEPT}/" if found else ""
    print(f"{len(found)} findings{where}, {time.monotonic() - started:.0f} s")
    short = [name for name, one in sums.items() if one.run < one.demanded]
    if short:
        print(f"not every input was run within {asked.minutes:g} minutes: {', '.join(short)}")
    return int(bool(found or short))


def _of_doors(total: int, seed: int, end_s: float) -> dict[str, Sum]:
    counts = doors.counts(total)
    sums = {name: Sum(demanded=count) for name, count in counts.items()}
    shares = {name: list(doors.shares(count, min(PARTS, count))) for name, count in counts.items()}
    parts = [
        (name, shares[name][part], seed * PARTS + part, end_s - GRACE_S)
        for part in range(PARTS)
        for name in counts
        if part < len(shares[name])
    ]
    outcomes = _outcomes(doors.fuzz_part, parts, end_s, doors.quiet_decoders)
    for (name, _, number, _), outcome in zip(parts, outcomes, strict=True):
        sums[name].add(outcome, f"seed {number}")
    for name, one in sums.items():
        print("\n".join(one.lines(name)))
    print(f"all doors       {sum(one.run for one in sums.values()):7d}", flush=True)
    return sums


def _of_commands(total: int, seed: int, end_s: float) -> Sum:
    every, result = len(commands.COMMANDS), Sum(demanded=total)
    parts = [
        (min(every, total - first), seed * total + first, end_s - GRACE_S) for first in range(0, total, every)
    ]
    for (_, number, _), outcome in zip(parts, _outcomes(commands.fuzz_part, parts, end_s), strict=True):
        result.add(outcome, f"seed {number}")
    print("\n".join(result.lines("commands")), flush=True)
    return result


def _outcomes(
    work: Callable[..., Outcome],
    parts: Sequence[tuple[object, ...]],
    end_s: float,
    prepare: Callable[[], None] | None = None,
) -> Iterator[Outcome | None]:
    """Outcome of each part; None of a part that has not ended at `end_s`, whose process is killed."""
    with multiprocessing.get_context("spawn").Pool(os.cpu_count(), prepare) as pool:
        running = [pool.apply_async(work, part) for part in parts]
        for one in running:
            try:
                yield one.get(max(0.0, end_s - time.monotonic()))
            except multiprocessing.TimeoutError:
                yield None


if __name__ == "__main__":
    sys.exit(main())
