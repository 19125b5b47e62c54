"""Times of records: parsed in UTC, and compared with the clock of this computer."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

CLOCK_TOLERANCE = timedelta(days=1)
"""Largest difference by clocks and time zones."""
CHECK_CLOCK = "check the clock of the computer"


def parsed_time(text: str) -> datetime | None:
    """Time of an ISO 8601 text, UTC where it has no zone; None if it is none."""
    try:
        time = datetime.fromisoformat(text)
        return time.replace(tzinfo=UTC) if time.tzinfo is None else time.astimezone(UTC)
    except (ValueError, OverflowError):
        return None


def is_future(time: datetime) -> bool:
    """Whether a time is after now: the clock that gave it, or that of this computer, is wrong."""
    return time - datetime.now(UTC) > CLOCK_TOLERANCE


def future_remark(what: str, made: str) -> str:
    """Remark on a time in ISO 8601 that is after now; empty for others, and for a text that is no time."""
    time = parsed_time(made)
    if time is None or not is_future(time):
        return ""
    return f"{what} is dated in the future ({made}): {CHECK_CLOCK}"
