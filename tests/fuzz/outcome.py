"""Numbers of inputs by their result, and what was found: of one part, and summed over parts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import islice


@dataclass
class Outcome:
    """Inputs of one part that were run."""

    results: Counter[str] = field(default_factory=Counter)
    """Number of inputs with each result."""
    found: dict[str, bytes] = field(default_factory=dict)
    """One input for each place in the code at which an unexpected error was raised, or a bound was passed."""

    @property
    def run(self) -> int:
        """Number of inputs."""
        return self.results.total()


@dataclass
class Sum(Outcome):
    """Sum over the parts of a door, or of the commands."""

    demanded: int = 0

    def add(self, part: Outcome | None, name: str) -> None:
        """Add a part; None: it has not ended in time, which is a finding."""
        if part is None:
            self.found[f"no answer: {name}"] = b""
        else:
            self.results += part.results
            self.found |= part.found

    def lines(self, name: str) -> list[str]:
        """Lines for the terminal; the number is that of the inputs that were run."""
        results = ", ".join(f"{result} {count}" for result, count in sorted(self.results.items()))
        missing = f" of {self.demanded}" if self.run < self.demanded else ""
        first = f"{name:15s} {self.run:7d}{missing}   {results}"
        return [first, *(f"    {line}" for line in first_lines(self.found))]


def first_lines(found: dict[str, bytes], most: int | None = None) -> Sequence[str]:
    """What was found, with the beginning of its input."""
    return [f"{what}: {content[:200]!r}" for what, content in islice(found.items(), most)]
