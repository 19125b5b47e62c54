"""Repairs of a session: decisions about its placements, made after it ended."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field

from workbench.model import event as ev


@dataclass
class Repairs:
    """Decisions of all repairs of a session; of each placement, the last one."""

    left_out: dict[str, str] = field(default_factory=dict)
    """Reasons by the keys of placements that do not count."""
    asked_again: dict[str, int] = field(default_factory=dict)
    """Numbers of the records before which answers for a placement do not count, by key."""
    attempts: Counter[str] = field(default_factory=Counter)
    """Numbers of repetitions by the key of the placement."""
    added_mm: list[float] = field(default_factory=list)
    """Standoffs of additional placements."""
    accepted_because: str | None = None
    """Reason to accept a calibration that fails its limits, by the last repair: after other changes it must
    be accepted again."""

    def counts(self, key: str, n: int) -> bool:
        """Whether an answer with a key, in record `n`, is not older than the decision about its placement."""
        placements = [one for one in self.asked_again if key == one or key.startswith(f"{one}/")]
        return all(n > self.asked_again[one] for one in placements)


def repairs_of(records: Iterable[ev.Record]) -> Repairs:
    """Repairs of a session from all of its records, also void ones."""
    found = Repairs()
    for record in records:
        event = record.event
        if not isinstance(event, ev.SessionRepaired):
            continue
        for key in (*event.recapture, *event.restore):
            found.left_out.pop(key, None)
            found.asked_again[key] = record.n
        found.attempts.update(event.recapture)
        found.left_out |= dict.fromkeys(event.leave_out, event.reason)
        found.added_mm += event.add_mm
        found.accepted_because = event.reason if event.accept else None
    return found
