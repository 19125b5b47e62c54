"""Remarks on readings as they come: a missing range with its cause, an error outside its 95 % interval."""

from __future__ import annotations

from workbench.model.number_text import significant
from workbench.model.trial_event import ReadingTaken


def reading_remark(reading: ReadingTaken) -> str:
    """Remark on a reading in one line; empty for one with a range inside its 95 % interval."""
    missing = {"off": reading.left_off, "blocked": reading.blocked}
    words = "".join(f" ({', '.join(ids)} {cause})" for cause, ids in missing.items() if ids)
    where = f"{reading.reference_mm:.6g} mm, reading {reading.reading}{words}"
    error, interval = reading.error_mm, reading.interval_mm
    if error is None:
        return f"{where}: no range: {reading.cause}"
    if interval is None or not reading.is_outside:
        return ""
    low, high = (significant(end, abs(error)) for end in interval)
    return f"{where}: error {significant(error, abs(error))} mm, outside its 95 % interval {low} to {high} mm"
