"""Verifications of a sensor: mean error and scatter of each session at up to five distances."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import exp, log
from pathlib import Path

import numpy as np

from workbench.model import event as ev
from workbench.model.arrays import FloatArray
from workbench.model.dates import parsed_time
from workbench.report.certificate.session_record import utc
from workbench.session.index import IndexedSession
from workbench.session.journal import read_journal
from workbench.session.state import effective
from workbench.trials.statistics.control_chart import FIRST_SESSIONS

DISTANCES = 5
"""Largest number of distances that are monitored."""
SAME_DISTANCE = 0.05
"""Largest relative difference of two standoffs of one distance."""
LEAST_SHARE = 0.8
"""Least number of sessions with a monitored distance, as a share of those with the most frequent one."""


@dataclass(frozen=True)
class DistanceCheck:
    """Readings of one session at one distance; relative to the true range."""

    range_mm: float
    error: float
    """Mean relative error."""
    scatter: float
    """Standard deviation of the readings' relative errors; NaN for one reading."""
    readings: int
    expanded: float = float("nan")
    """Stated expanded uncertainty U of the error, 95 %; NaN: not known."""


@dataclass(frozen=True)
class Verification:
    """Readings of one session of a flat target."""

    session: str
    day: str
    """ISO 8601."""
    time_ns: int
    """Time of the first reading, ns since 1970 (UTC)."""
    calibration: str
    """sha256 of the calibration that the readings use."""
    checks: tuple[DistanceCheck, ...]
    valid: bool = True
    """Whether no trial of the session found the calibration not valid."""

    def at(self, range_mm: float) -> DistanceCheck | None:
        """The check at a distance; None if the session has none."""
        near = [one for one in self.checks if is_same_distance(one.range_mm, range_mm)]
        return min(near, key=lambda one: abs(log(one.range_mm / range_mm)), default=None)


def verifications(folder: Path, sessions: Iterable[IndexedSession]) -> tuple[Verification, ...]:
    """Verifications of the sessions that have readings, in order of time.

    Args:
        folder: folder of sessions.
        sessions: sessions of one sensor; those without readings are left out.

    Raises:
        BadInputError: a journal is damaged.
    """
    found = [_verification(folder / one.name, one) for one in sessions if one.verified]
    return tuple(sorted((one for one in found if one is not None), key=lambda one: one.time_ns))


def monitored_mm(checked: Sequence[Verification]) -> tuple[float, ...]:
    """Distances that most of the first k sessions share, at most `DISTANCES` of them, evenly by their ratio.

    Later sessions do not change them: an alarm stays.
    """
    common = common_mm(checked)
    if len(common) <= DISTANCES:
        return common
    chosen: list[float] = []
    for mm in np.geomspace(common[0], common[-1], DISTANCES).tolist():
        free = [one for one in common if one not in chosen]
        chosen.append(min(free, key=lambda one: abs(log(one / mm))))
    return tuple(sorted(chosen))


def common_mm(checked: Sequence[Verification]) -> tuple[float, ...]:
    """Distances that most of the first k sessions share, in increasing order."""
    counts: dict[float, int] = {}
    for one in checked[:FIRST_SESSIONS]:
        known = {
            next((mm for mm in counts if is_same_distance(mm, check.range_mm)), check.range_mm)
            for check in one.checks
        }
        counts |= {mm: counts.get(mm, 0) + 1 for mm in known}
    most = max(counts.values(), default=0)
    return tuple(sorted(mm for mm, count in counts.items() if count >= LEAST_SHARE * most))


def unmonitored_texts(checked: Sequence[Verification], monitored: Sequence[float]) -> list[str]:
    """Distances of the sessions that are not monitored, one text for each reason."""
    common = common_mm(checked)
    found = unmonitored_mm(checked, monitored)
    spare = [mm for mm in found if any(is_same_distance(mm, one) for one in common)]
    rare = [mm for mm in found if mm not in spare]
    reasons = (
        (spare, f"at most {DISTANCES} distances are monitored, because each adds false alarms"),
        (rare, f"too few of the first {FIRST_SESSIONS} sessions have it"),
    )
    return [
        f"not monitored: {', '.join(f'{mm:g}' for mm in those)} mm ({why})" for those, why in reasons if those
    ]


def unmonitored_mm(checked: Sequence[Verification], monitored: Sequence[float]) -> tuple[float, ...]:
    """Distances of the sessions that are not monitored, in increasing order."""
    found: list[float] = []
    for mm in sorted(check.range_mm for one in checked for check in one.checks):
        if not any(is_same_distance(mm, known) for known in (*monitored, *found)):
            found.append(mm)
    return tuple(found)


def is_same_distance(a_mm: float, b_mm: float) -> bool:
    """Whether two standoffs count as one distance."""
    return max(a_mm, b_mm) / min(a_mm, b_mm) <= exp(SAME_DISTANCE)


def _verification(session_dir: Path, indexed: IndexedSession) -> Verification | None:
    calibration, time_ns, valid = "", 0, True
    errors: dict[float, list[tuple[float, float]]] = {}
    for record in effective(read_journal(session_dir)):
        event = record.event
        if isinstance(event, ev.CalibrationExported | ev.CalibrationLoaded):
            calibration = event.sha256
        elif isinstance(event, ev.ReadingTaken) and (error := _relative_error(event)) is not None:
            time_ns = time_ns or record.time_ns
            errors.setdefault(event.standoff_mm, []).append((error, _expanded(event)))
        elif isinstance(event, ev.TrialFinished) and event.refuses_calibration:
            time_ns, valid = time_ns or record.time_ns, False
    if valid and not errors:
        return None
    checks = tuple(_check(mm, np.array(values)) for mm, values in sorted(errors.items()))
    began = parsed_time(indexed.began)
    day = indexed.began[:10] if began is not None else f"{utc(time_ns):%Y-%m-%d}"
    return Verification(indexed.name, day, time_ns, calibration, checks, valid)


def _relative_error(reading: ev.ReadingTaken) -> float | None:
    """Error of a range over the true range; None without a range, or where the true range is not known."""
    if reading.error_mm is None or reading.true is not None or reading.reference_sd_mm is None:
        return None
    if not reading.is_measured:
        return None
    return reading.error_mm / reading.reference_mm


def _expanded(reading: ev.ReadingTaken) -> float:
    """U of the error over the true range, on the side of the true range; NaN if it is not stated."""
    if reading.interval_mm is None or reading.range_mm is None:
        return float("nan")
    low_mm, high_mm = reading.interval_mm
    below = reading.range_mm > reading.reference_mm
    return (reading.range_mm - low_mm if below else high_mm - reading.range_mm) / reading.reference_mm


def _check(range_mm: float, values: FloatArray) -> DistanceCheck:
    errors, expanded = values.T
    scatter = float(errors.std(ddof=1)) if len(errors) > 1 else float("nan")
    return DistanceCheck(range_mm, float(errors.mean()), scatter, len(errors), float(expanded.mean()))
