"""Remarks on readings as they come: a missing range with its cause, an error outside its 95 % interval."""

from __future__ import annotations

from workbench.model.number_text import significant
from workbench.model.trial_event import ReadingTaken


def reading_remark(reading: ReadingTaken) -> str:
    """Remark on a reading in one line; empty for one with a range inside its 95 % interval."""
    where = f"{reading.reference_mm:.6g} mm, reading {reading.reading}"
    error, half = reading.error_mm, reading.half_interval_mm
    if error is None:
        return f"{where}: no range: {reading.cause}"
    if half is None or not reading.is_outside:
        return ""
    return (
        f"{where}: error {significant(error, half)} mm, outside its 95 % interval of"
        f" +-{significant(half, half)} mm"
    )
