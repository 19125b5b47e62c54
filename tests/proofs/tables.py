"""Tables that a proof prints and keeps in docs/benchmarks."""

from __future__ import annotations

import datetime as dt
from collections.abc import Sequence
from pathlib import Path

RESULTS = Path(__file__).parents[2] / "docs" / "benchmarks"


def keep(name: str, title: str, lines: Sequence[str]) -> None:
    """Print a table and write it to the day's file; the title is followed by day and command."""
    today = dt.datetime.now(tz=dt.UTC).date().isoformat()
    text = "\n".join([f"{title}, {today}: `python -m tests.proofs.{name}`", *lines])
    print(text)
    RESULTS.mkdir(parents=True, exist_ok=True)
    (RESULTS / f"{today}-{name}.txt").write_text(text + "\n")
